#include "task/line_reader.h"

#include <algorithm>
#include <string_view>

#include "task/config_error.h"

namespace forereach {
namespace {

constexpr std::size_t kLongestLine = std::size_t{1} << 20;

}  // namespace

LineReader::LineReader(const std::string& path, const std::string& named_by)
    : path_(path), file_(path, kLargestCsvFile, named_by), chunk_(1 << 16, '\0') {}

bool LineReader::Next(std::string& text) {
  text.clear();
  ++line_;
  while (true) {
    if (begin_ == end_) {
      begin_ = 0;
      end_ = file_.Read(chunk_.data(), chunk_.size());
      if (end_ == 0) return !text.empty();
    }
    const std::string_view rest(chunk_.data() + begin_, end_ - begin_);
    const std::size_t length = std::min(rest.find('\n'), rest.size());
    if (text.size() + length > kLongestLine)
      throw ConfigError(path_ + ":" + std::to_string(line_) + ": longer than " + std::to_string(kLongestLine) +
                        " bytes, which no row of numbers is");
    text.append(rest.substr(0, length));
    begin_ += std::min(length + 1, rest.size());
    if (length < rest.size()) return true;
  }
}

}  // namespace forereach
