#include "identify/log_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <csv.h>

#include "command_line/nearest.h"
#include "forereach/numerics/text.h"
#include "task/config_error.h"
#include "task/date.h"
#include "task/line_reader.h"
#include "task/number.h"

namespace forereach {
namespace {

constexpr std::size_t kShown = 40;            // bytes of a field in a message
constexpr std::size_t kLongestRow = 1 << 24;  // bytes, of a row that quotes spread over lines

std::string Name(char delimiter) { return delimiter == '\t' ? "tab" : std::string(1, delimiter); }

// Recorders pad numbers with zeros, which ParseNumber refuses: in a task file they may mean octal, in a log they do
// not.
Parsed<double> ParseLogged(std::string_view field) {
  if (const Parsed<double> plain = ParseNumber(field); plain.problem.empty()) return plain;
  std::string digits(field);
  const std::size_t first = digits.starts_with('+') || digits.starts_with('-') ? 1 : 0;
  std::size_t zeros = 0;
  while (first + zeros + 1 < digits.size() && digits[first + zeros] == '0' && IsDigit(digits[first + zeros + 1]))
    ++zeros;
  return ParseNumber(digits.erase(first, zeros));
}

bool IsNumber(std::string_view field) { return ParseLogged(field).problem.empty(); }

// Why a file that begins like this is no text, and what converts it; empty if it may be text.
std::string WhyNoText(std::string_view begin) {
  using namespace std::string_view_literals;
  constexpr std::pair<std::string_view, const char*> kKinds[] = {
      {"#ROSBAG"sv, "is a bag of ROS 1; `rosbags-convert` makes an MCAP file of it"},
      {"SQLite format 3"sv, "is a database, as bags of ROS 2 may be; `ros2 bag convert` makes an MCAP file of it"},
      {"\x89MCAP"sv, "is an MCAP file; its name has to end in .mcap"},
      {"\xed\xa1\xda\x01"sv, "is an LCM log; give the types of its messages with --lcm-types"},
      {"\x1f\x8b"sv, "is compressed; `gunzip` unpacks it"},
      {"\x28\xb5\x2f\xfd"sv, "is compressed; `unzstd` unpacks it"},
      {"PK\3\4"sv, "is a zip archive, as spreadsheets are; save the table as CSV"},
      {"PAR1"sv, "is a Parquet file; save the table as CSV"},
      {"\xff\xfe"sv, "is in UTF-16; `iconv -f UTF-16 -t UTF-8` makes UTF-8 of it"},
      {"\xfe\xff"sv, "is in UTF-16; `iconv -f UTF-16 -t UTF-8` makes UTF-8 of it"}};
  for (const auto& [magic, why] : kKinds)
    if (begin.starts_with(magic)) return why;
  return begin.find('\0') == std::string_view::npos ? "" : "is no text: it has a zero byte in its first line";
}

bool HasDecimalComma(std::string field) {
  const std::size_t at = field.find(',');
  return at != std::string::npos && IsNumber(field.replace(at, 1, "."));
}

// libcsv's parser, fed line by line. Its callbacks are called from C, so they throw nothing.
class RowParser {
 public:
  explicit RowParser(char delimiter) : delimiter_(delimiter) { Begin(); }
  ~RowParser() { csv_free(&parser_); }
  RowParser(const RowParser&) = delete;
  RowParser& operator=(const RowParser&) = delete;

  // Empty, or why the row is given up.
  std::string Feed(const std::string& line) {
    if (complete_) fields_.clear(), bytes_ = 0;
    complete_ = goes_on_ = false;
    bytes_ += line.size() + 1;
    std::string problem;
    if (!Parse(delimiter_ == ' ' ? WithTabs(line) : line) || !Parse("\n"))
      problem = "quotes inside a field";
    else if (goes_on_)  // libcsv ends a row there, which may be one of another recorder, or a row that was cut off
      problem = "a carriage return inside a row";
    else if (bytes_ > kLongestRow)
      problem = fmt::format("longer than {} bytes", kLongestRow);
    if (problem.empty()) return "";
    csv_free(&parser_);
    Begin();
    return problem;
  }

  [[nodiscard]] char delimiter() const { return delimiter_; }
  [[nodiscard]] bool is_complete() const { return complete_; }
  [[nodiscard]] const std::vector<std::string>& fields() const { return fields_; }

 private:
  void Begin() {
    csv_init(&parser_, CSV_STRICT);
    csv_set_delim(&parser_, static_cast<unsigned char>(delimiter_ == ' ' ? '\t' : delimiter_));
    complete_ = true;
  }
  // One tab for all blanks between two fields, which are not inside quotes.
  static std::string WithTabs(const std::string& line) {
    std::string text;
    bool quoted = false;
    for (const char c : Trimmed(line)) {
      if (c == '"') quoted = !quoted;
      const bool is_blank = !quoted && (c == ' ' || c == '\t');
      if (!is_blank) text += c;
      if (is_blank && !text.ends_with('\t')) text += '\t';
    }
    return text;
  }
  bool Parse(const std::string& text) {
    return csv_parse(&parser_, text.data(), text.size(), &RowParser::TakeField, &RowParser::EndRow, this) ==
           text.size();
  }
  static void TakeField(void* text, std::size_t size, void* self) noexcept {
    auto& parser = *static_cast<RowParser*>(self);
    parser.goes_on_ |= parser.complete_;
    parser.fields_.emplace_back(static_cast<const char*>(text), size);
  }
  static void EndRow(int, void* self) noexcept { static_cast<RowParser*>(self)->complete_ = true; }

  const char delimiter_;
  csv_parser parser_{};
  std::vector<std::string> fields_;
  std::size_t bytes_ = 0;
  bool complete_ = true;  // no row is begun and not ended
  bool goes_on_ = false;  // the line has a field behind the end of a row
};

class Reader {
 public:
  Reader(const std::string& path, const std::vector<std::string>& wanted, const LogFormat& format)
      : wanted_(wanted.begin(), wanted.end()), format_(format), lines_(path) {
    table_.path = path;
    table_.not_a_number.resize(wanted.size());
    if (!format.header.empty()) TakeHeader(format.header);
  }

  LogTable Read() {
    ReadLines([] { return true; });
    using RowMajor = decltype(table_.values);
    table_.values = Eigen::Map<const RowMajor>(numbers_.data(), std::ssize(table_.lines), std::ssize(wanted_));
    return std::move(table_);
  }

  std::vector<std::string> ReadColumns() {
    if (!format_.header.empty()) return format_.header;
    ReadLines([this] { return num_fields_ == 0; });
    if (const std::string why = WhyNoHeader(header_); !why.empty()) Fail(first_line_, why);
    return header_;
  }

 private:
  // Reads on while `goes_on()`. Fails at the end of the file without a header or inside a quoted field.
  template <class Condition>
  void ReadLines(const Condition& goes_on) {
    for (std::string line; goes_on() && lines_.Next(line);) {
      if (const std::string why = lines_.line() == 1 ? WhyNoText(line) : ""; !why.empty())
        throw ConfigError("{}: {}", table_.path, why);
      if (IsRow(line)) Take(line);
    }
    if (parser_ && !parser_->is_complete()) Fail(first_line_, "a quoted field begins in this row and does not end");
    if (num_fields_ == 0)
      throw ConfigError("{}:1: no line that names the columns; give their names with --header", table_.path);
  }

  [[noreturn]] void Fail(int line, const std::string& what) const {
    throw ConfigError("{}:{}: {}", table_.path, line, what);
  }

  // Whether the line is a row or a part of one, and not blank or a comment.
  bool IsRow(const std::string& line) {
    if (parser_ && !parser_->is_complete()) return true;
    first_line_ = lines_.line();
    const std::string_view content = Trimmed(line);
    if (!format_.comment.empty() && content.starts_with(format_.comment)) {
      table_.comments.Add(first_line_);
      if (num_fields_ == 0) comments_.emplace_back(Trimmed(content.substr(format_.comment.size())));
      return false;
    }
    if (content.empty()) table_.blank.Add(first_line_);
    return !content.empty();
  }

  void Take(const std::string& line) {
    if (!parser_) parser_ = std::make_unique<RowParser>(DelimiterOf(line));
    if (const std::string problem = parser_->Feed(line); !problem.empty()) {
      if (num_fields_ == 0)
        Fail(first_line_,
             fmt::format("the names of the columns: {}{}", problem,
                         line.find('\r') == std::string::npos ? "" : "; `tr '\\r' '\\n'` makes lines of it"));
      Lose(problem);
    } else if (parser_->is_complete()) {
      if (num_fields_ == 0)
        TakeFirst(parser_->fields());
      else if (!IsSecondHeader(parser_->fields()))
        TakeRow(parser_->fields());
    }
  }

  [[nodiscard]] char DelimiterOf(const std::string& line) const {
    if (format_.delimiter) return *format_.delimiter;
    std::string found;
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      const bool separates = c == ';' || c == '\t' || (c == ',' && !format_.decimal_comma);
      if (!quoted && separates && found.find(c) == std::string::npos) found += c;
    }
    if (found.size() > 1)
      Fail(first_line_,
           fmt::format("the fields may be separated by {} or by {}; say which it is", Name(found[0]), Name(found[1])));
    if (!found.empty()) return found[0];
    return Trimmed(line).find(' ') == std::string_view::npos ? ',' : ' ';
  }

  // The first row names the columns; of numbers, a comment before it may.
  void TakeFirst(const std::vector<std::string>& fields) {
    const bool is_row = std::ranges::all_of(fields, [this](const std::string& field) { return IsValue(field); });
    const std::vector<std::string> names = is_row ? NamesInComments(fields.size()) : std::vector<std::string>();
    if (names.empty()) return TakeHeader(fields);
    TakeHeader(names);
    TakeRow(fields);
  }

  // The first comment with so many names, all wanted ones among them if there is such a comment.
  [[nodiscard]] std::vector<std::string> NamesInComments(std::size_t count) const {
    std::vector<std::string> first;
    for (const std::string& comment : comments_) {
      std::vector<std::string> names = NamesIn(comment);
      if (names.size() != count) continue;
      const bool has_all = std::ranges::all_of(wanted_, [&](const WantedColumn& wanted) {
        return std::ranges::all_of(
            wanted.names(), [&](const std::string& name) { return std::ranges::find(names, name) != names.end(); });
      });
      if (has_all) return names;
      if (first.empty()) first = std::move(names);
    }
    return first;
  }

  [[nodiscard]] bool IsValue(const std::string& field) const {
    return IsNumber(field) || (format_.decimal_comma && HasDecimalComma(field)) || SecondsOfDate(field).has_value();
  }

  // A number or a date; NaN for anything else.
  double ValueOf(std::string field) {
    if (format_.decimal_comma)
      if (const std::size_t at = field.find(','); at != std::string::npos) field[at] = '.';
    const auto [value, problem] = ParseLogged(field);
    if (problem.empty()) return value;
    const auto seconds = SecondsOfDate(field);
    if (!seconds) return std::numeric_limits<double>::quiet_NaN();
    table_.dates.Add(first_line_, field.substr(0, kShown));
    return static_cast<double>(*seconds);
  }

  void TakeHeader(const std::vector<std::string>& names) {
    const int line = std::max(1, lines_.line());
    if (parser_ && parser_->delimiter() == ',' && format_.decimal_comma)
      Fail(line, "commas separate the fields, so a number with a decimal comma is two");
    for (const WantedColumn& wanted : wanted_) {
      std::vector<std::size_t>& places = places_.emplace_back();
      for (const std::string& name : wanted.names()) {
        const auto count = std::ranges::count(names, name);
        if (count == 0) {
          const std::string why = WhyNoHeader(names);
          Fail(line, why.empty() ? fmt::format("no column '{}'; {}", name, Suggestion(name, names)) : why);
        }
        if (count > 1) Fail(line, fmt::format("{} columns are named '{}'", count, name));
        places.push_back(static_cast<std::size_t>(std::ranges::find(names, name) - names.begin()));
      }
    }
    num_fields_ = names.size();
    header_ = names;
  }

  // Why fields that should be names seem to be none; empty if they may be.
  [[nodiscard]] std::string WhyNoHeader(const std::vector<std::string>& fields) const {
    if (fields.size() == 1) {
      constexpr std::pair<char, const char*> kSeparators[] = {
          {',', "commas"}, {';', "semicolons"}, {'\t', "tabs"}, {' ', "blanks"}};
      for (const auto& [separator, name] : kSeparators)
        if (fields[0].find(separator) != std::string::npos)
          return fmt::format("the fields seem to be separated by {}", name);
    }
    if (!std::ranges::all_of(fields, IsNumber)) return "";
    return "this line has numbers only, so no column has a name; give the names with --header";
  }

  // The names in a comment; empty if one of its fields is empty or a number.
  [[nodiscard]] std::vector<std::string> NamesIn(const std::string& text) const {
    RowParser parser(parser_->delimiter());
    if (!parser.Feed(text).empty() || !parser.is_complete() ||
        std::ranges::any_of(parser.fields(), [](const std::string& field) { return field.empty() || IsNumber(field); }))
      return {};
    return parser.fields();
  }

  // Skips a line that repeats the header; fails at one that has its names and differs.
  bool IsSecondHeader(const std::vector<std::string>& fields) {
    if (std::ranges::any_of(fields, IsNumber)) return false;
    if (fields == header_) {
      // A recorder began anew here: no transition spans that.
      table_.headers.Add(first_line_);
      lost_ = true;
      return true;
    }
    const auto is_name = [this](const std::string& field) {
      return std::ranges::find(header_, field) != header_.end();
    };
    // Directly behind the header, units may stand, and one may be spelled as a column is.
    const std::size_t enough = table_.lines.empty() ? wanted_.size() : std::min<std::size_t>(2, wanted_.size());
    if (static_cast<std::size_t>(std::ranges::count_if(fields, is_name)) >= enough)
      Fail(first_line_, fmt::format("a second header that differs from the first: {}; split the file there",
                                    fmt::join(fields, ", ")));
    return false;
  }

  void TakeRow(const std::vector<std::string>& fields) {
    if (fields.size() != num_fields_) {
      Lose(fmt::format("{} fields, the header has {}{}", fields.size(), num_fields_,
                       fields.size() == 2 * num_fields_ ? ": twice as many, as if each number had a decimal comma"
                       : fields.size() == num_fields_ + 1 && fields.back().empty()
                           ? ": the last is empty, as if a separator ended the row; end the header so, too"
                           : ""));
      return;
    }
    for (std::size_t j = 0; j < places_.size(); ++j) {
      std::vector<double> values;
      for (const std::size_t place : places_[j]) values.push_back(ValueOf(fields[place]));
      numbers_.push_back(wanted_[j].Of(values));
      if (std::isfinite(numbers_.back())) continue;
      const auto wrong = std::ranges::find_if(values, [](double value) { return std::isnan(value); });
      const std::size_t at = wrong == values.end() ? 0 : static_cast<std::size_t>(wrong - values.begin());
      const std::string& field = fields[places_[j][at]];
      table_.not_a_number[j].Add(first_line_, field.substr(0, kShown));
      if (!format_.decimal_comma && HasDecimalComma(field))
        table_.decimal_commas.Add(first_line_, field.substr(0, kShown));
    }
    table_.lines.push_back(first_line_);
    table_.after_loss.push_back(std::exchange(lost_, false));
  }

  void Lose(const std::string& why) {
    table_.lost.Add(first_line_, why);
    lost_ = true;
  }

  const std::vector<WantedColumn> wanted_;
  const LogFormat& format_;
  LineReader lines_;
  LogTable table_;
  std::unique_ptr<RowParser> parser_;             // from the first row on, which shows the delimiter
  std::size_t num_fields_ = 0;                    // 0 before the header
  std::vector<std::vector<std::size_t>> places_;  // of the wanted columns
  std::vector<double> numbers_;                   // row by row
  std::vector<std::string> header_;               // the names of all columns
  std::vector<std::string> comments_;             // before the header
  int first_line_ = 0;                            // of the row
  bool lost_ = false;
};

}  // namespace

void Finding::Add(int line, const std::string& what) {
  if (count++ > 0) return;
  first_line = line;
  first = what;
}

LogTable ReadLog(const std::string& path, const std::vector<std::string>& wanted, const LogFormat& format) {
  return Reader(path, wanted, format).Read();
}

std::vector<std::string> LogColumns(const std::string& path, const LogFormat& format) {
  const std::vector<std::string> none;
  return Reader(path, none, format).ReadColumns();
}

WantedColumn::WantedColumn(const std::string& text) : names_{text} {
  const std::size_t open = text.find('(');
  const std::string function = text.substr(0, open);
  if (open == std::string::npos || !text.ends_with(')') || (function != "yaw_of" && function != "seconds_of")) return;
  std::vector<std::string> arguments;
  for (std::size_t begin = open + 1; begin < text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size() - 1);
    arguments.emplace_back(Trimmed(std::string_view(text).substr(begin, end - begin)));
    begin = end + 1;
  }
  const std::size_t count = arguments.size();
  if (function == "yaw_of" && count != 2 && count != 4)
    throw ConfigError("{}: has to be yaw_of(qx,qy,qz,qw), or yaw_of(qz,qw) of a turn about z alone", text);
  if (function == "seconds_of" && count != 2) throw ConfigError("{}: has to be seconds_of(SECONDS,NANOSECONDS)", text);
  kind_ = function == "seconds_of" ? Kind::kSeconds : count == 2 ? Kind::kHalfYaw : Kind::kYaw;
  names_ = std::move(arguments);
}

double WantedColumn::Of(const std::vector<double>& v) const {
  const auto if_unit = [](double square, double yaw) {
    // Room for a quaternion of few digits; farther off it is no rotation.
    constexpr double kOff = 0.01;
    return std::abs(std::sqrt(square) - 1) <= kOff ? yaw : std::numeric_limits<double>::quiet_NaN();
  };
  switch (kind_) {
    case Kind::kPlain: return v[0];
    case Kind::kSeconds: return v[0] + v[1] * 1e-9;
    case Kind::kHalfYaw:
      return if_unit(v[0] * v[0] + v[1] * v[1], std::remainder(2 * std::atan2(v[0], v[1]), 2 * std::numbers::pi));
    case Kind::kYaw: break;
  }
  const double x = v[0], y = v[1], z = v[2], w = v[3];
  return if_unit(x * x + y * y + z * z + w * w, std::atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z));
}

}  // namespace forereach
