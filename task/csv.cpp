#include "task/csv.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "command_line/nearest.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "task/config_error.h"
#include "task/line_reader.h"
#include "task/number.h"

namespace forereach {
namespace {

[[noreturn]] void FailAt(const std::string& path, int line, const std::string& what) {
  throw ConfigError("{}:{}: {}", path, line, what);
}

void Split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  for (std::size_t comma; (comma = line.find(',')) != std::string_view::npos; line.remove_prefix(comma + 1))
    fields.push_back(Trimmed(line.substr(0, comma)));
  fields.push_back(Trimmed(line));
}

// Fails if the header's fields are separated by something else.
void RequireCommas(const std::string& path, const std::vector<std::string_view>& fields, const std::string& advice) {
  if (fields.size() > 1) return;
  constexpr std::pair<char, const char*> kOthers[] = {{';', "semicolons"}, {'\t', "tabs"}, {' ', "blanks"}};
  for (const auto& [other, name] : kOthers)
    if (fields[0].find(other) != std::string_view::npos)
      FailAt(path, 1,
             fmt::format("the columns are separated by {}; put commas in their place, and decimal points in numbers{}",
                         name, advice));
}

// For each field of the header, the column it is of.
std::vector<Eigen::Index> ReadHeader(const std::string& path, const std::vector<std::string_view>& fields,
                                     const std::vector<std::string>& columns, const std::string& advice) {
  RequireCommas(path, fields, advice);
  std::vector<Eigen::Index> order;
  for (const std::string_view field : fields) {
    const auto column = std::find(columns.begin(), columns.end(), field);
    if (column == columns.end())
      FailAt(path, 1, fmt::format("unknown column '{}'; the columns are {}{}", field, Joined(columns), advice));
    const Eigen::Index index = column - columns.begin();
    if (std::find(order.begin(), order.end(), index) != order.end())
      FailAt(path, 1, fmt::format("{}: duplicate column", *column));
    order.push_back(index);
  }
  for (std::size_t j = 0; j < columns.size(); ++j)
    if (std::find(order.begin(), order.end(), static_cast<Eigen::Index>(j)) == order.end())
      FailAt(path, 1, fmt::format("{}: the column is missing{}", columns[j], advice));
  return order;
}

class Reader {
 public:
  Reader(const std::string& path, const std::vector<std::string>& columns, const std::string& advice,
         const std::string& optional)
      : path_(path), columns_(columns), advice_(advice), optional_(optional) {}

  Eigen::MatrixXd Read(LineReader in) {
    std::vector<Eigen::Index> order;
    std::vector<std::string_view> fields;
    int rows = -1;  // without the header
    int blank = 0;  // the first of the blank lines that may end the file
    for (std::string text; in.Next(text);) {
      const int line = in.line();
      // A blank line between rows is a row that was lost, so only the end may have some.
      if (line > 1 && Trimmed(text).empty()) {
        blank = blank == 0 ? line : blank;
        continue;
      }
      if (blank > 0) FailAt(path_, blank, "a blank line; only the end of the file may have some");
      ++rows;
      Split(text, fields);
      if (line == 1) {
        if (!optional_.empty() && Has(fields, optional_) && !Has(columns_, optional_)) columns_.push_back(optional_);
        order = ReadHeader(path_, fields, columns_, advice_);
      } else {
        AddRow(line, fields, order);
      }
    }
    if (rows < 0)
      throw ConfigError("{}:1: the file is empty; it has to begin with the header {}", path_, Joined(columns_));
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    return Eigen::Map<const RowMajor>(numbers_.data(), rows, std::ssize(columns_));
  }

 private:
  static bool Has(const auto& names, const std::string& name) { return std::ranges::find(names, name) != names.end(); }
  void AddRow(int line, const std::vector<std::string_view>& fields, const std::vector<Eigen::Index>& order) {
    if (fields.size() != order.size())
      FailAt(path_, line,
             fmt::format("{} fields, the header has {}{}", fields.size(), order.size(),
                         fields.size() > order.size() ? "; numbers have a decimal point, not a comma" : ""));
    const std::size_t row = numbers_.size();
    numbers_.resize(row + fields.size());
    for (std::size_t j = 0; j < fields.size(); ++j) {
      const auto column = ToSize(order[j]);
      const auto [value, problem] = ParseNumber(fields[j]);
      if (!problem.empty())
        FailAt(path_, line, fmt::format("{}: '{}' {}", columns_[column], fields[j].substr(0, 40), problem));
      numbers_[row + column] = value;
    }
  }

  const std::string& path_;
  std::vector<std::string> columns_;
  const std::string &advice_, &optional_;
  std::vector<double> numbers_;  // row by row
};

}  // namespace

std::vector<std::string> CsvColumns(const std::string& path) {
  std::string text;
  if (!LineReader(path).Next(text)) throw ConfigError("{}:1: the file is empty; it has to begin with a header", path);
  std::vector<std::string_view> fields;
  Split(text, fields);
  RequireCommas(path, fields, "");
  std::vector<std::string> columns(fields.begin(), fields.end());
  for (const std::string& column : columns) {
    if (column.empty()) FailAt(path, 1, "a column has no name");
    if (std::ranges::count(columns, column) > 1)
      FailAt(path, 1, fmt::format("{}: duplicate column", column.substr(0, 64)));
  }
  return columns;
}

Eigen::MatrixXd ReadCsv(const std::string& path, const std::vector<std::string>& columns, const std::string& named_by,
                        const std::string& advice, const std::string& optional) {
  return Reader(path, columns, advice, optional).Read(LineReader(path, named_by));
}

void WriteCsv(const std::string& path, const std::vector<std::string>& columns, const Eigen::MatrixXd& rows) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  const auto write_row = [&](const auto& field) {
    for (std::size_t j = 0; j < columns.size(); ++j) out << (j == 0 ? "" : ",") << field(j);
    out << '\n';
  };
  write_row([&](std::size_t j) { return columns[j]; });
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    write_row([&](std::size_t j) { return ToText(rows(i, static_cast<Eigen::Index>(j))); });
  out.close();
  if (!out) throw ConfigError("{}: cannot be written: {}", path, std::generic_category().message(errno));
}

}  // namespace forereach
