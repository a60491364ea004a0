/** CSV files of numbers: a header line that names the columns, then one row of numbers a line.

Columns may have any order. White space around a field is ignored, and so are blank lines at the end of the file.
Errors: a missing, repeated or unknown column, a blank line before another row, quotes, comments, another separator. */
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace forereach {

/** The columns that a file's header names, at least one. @throws ConfigError if it cannot be read or has none. */
[[nodiscard]] std::vector<std::string> CsvColumns(const std::string& path);

/** @return one row a line, columns in the order of `columns`. Row i is line i + 2 of the file.
@param named_by prefix of the message if the file cannot be opened: the place that names it. @param advice end of the
message if the header has other columns or separators. @param optional a column that the file may have beside these; it
is the last one then.
@throws ConfigError with file, line and column. */
[[nodiscard]] Eigen::MatrixXd ReadCsv(const std::string& path, const std::vector<std::string>& columns,
                                      const std::string& named_by = "", const std::string& advice = "",
                                      const std::string& optional = "");

/** Writes the shortest decimals from which ReadCsv returns the same doubles. @throws ConfigError if the file cannot be
written. */
void WriteCsv(const std::string& path, const std::vector<std::string>& columns, const Eigen::MatrixXd& rows);

}  // namespace forereach
