#include "task/line_reader.h"

#include <algorithm>

#include "task/config_error.h"

namespace forereach {
namespace {

constexpr std::size_t kLongestLine = std::size_t{1} << 20;
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

}  // namespace

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  return first == std::string_view::npos ? "" : text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

LineReader::LineReader(const std::string& path, const std::string& named_by)
    : path_(path), file_(path, kLargestCsvFile, named_by), chunk_(1 << 16, '\0') {}

bool LineReader::Next(std::string& text) {
  const bool found = ReadLine(text);
  if (line_ == 1 && text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  return found;
}

bool LineReader::ReadLine(std::string& text) {
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
      throw ConfigError("{}:{}: longer than {} bytes, which no row of numbers is", path_, line_, kLongestLine);
    text.append(rest.substr(0, length));
    begin_ += std::min(length + 1, rest.size());
    if (length < rest.size()) return true;
  }
}

}  // namespace forereach
