/** CSV files of numbers: a header line that names the columns, then one row of numbers a line.

Columns may stand in any order, white space around a field does not count, and nothing else is allowed: no missing,
double or further column, no empty line, no quotes, no comments. */
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace forereach {

/** @return one row a line, columns in the order of `columns`. Row i stands in line i + 2 of the file.
@param named_by goes before the message if the file cannot be opened: the place that names it.
@throws ConfigError naming file, line and column. */
[[nodiscard]] Eigen::MatrixXd ReadCsv(const std::string& path, const std::vector<std::string>& columns,
                                      const std::string& named_by = "");

/** Writes the shortest decimals that read back as the same doubles. @throws ConfigError if the file cannot be written.
 */
void WriteCsv(const std::string& path, const std::vector<std::string>& columns, const Eigen::MatrixXd& rows);

}  // namespace forereach
