/** Text files of rows, line by line: a file of ten million rows is larger than what is kept of it. */
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "task/files.h"

namespace forereach {

/** Without the white space around it. */
[[nodiscard]] std::string_view Trimmed(std::string_view text);

class LineReader final {
 public:
  /** @param named_by prefix of the message if the file cannot be opened: the place that names it. @throws ConfigError
  as InputFile does. */
  explicit LineReader(const std::string& path, const std::string& named_by = "");

  /** Sets `text` to the next line, without its end and without a byte order mark. As with std::getline, the last line
  need not end. False at the end.
  @throws ConfigError if reading fails, or if a line is longer than a mebibyte, which no row of numbers is. */
  [[nodiscard]] bool Next(std::string& text);

  /** The number of the line that Next has read; the first is 1. */
  [[nodiscard]] int line() const { return line_; }

 private:
  bool ReadLine(std::string& text);

  const std::string path_;
  InputFile file_;
  std::string chunk_;
  std::size_t begin_ = 0, end_ = 0;
  int line_ = 0;
};

}  // namespace forereach
