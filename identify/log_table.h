/** Logs as they come: CSV files whose header names the columns, of which some are wanted. The other columns may hold
anything.

Fields may be in double quotes, also column names. White space around a field is ignored, and so are blank lines and
comment lines. Nothing is guessed: a field that is neither one decimal number nor a date is NaN and counted, and a row
with more or fewer fields than the header is left out and counted. Zeros in front of a number are part of it: 08.00
is 8. A date of ISO 8601, such as 2026-01-31T12:00:00.25+01:00, is its seconds since 1970; without a zone it is UTC. A
line that repeats the header is skipped and counted; a header that differs is refused. If the file begins with numbers,
a comment before them with as many names as they have fields is the header. libcsv reads the fields. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace forereach {

struct LogFormat {
  /** ',', ';', a tab, or ' ' for any blanks and tabs. None: the one of them that the header contains, blanks if none
   * else.
   */
  std::optional<char> delimiter;
  bool decimal_comma = false;  ///< 0,5 is a half. Fields are not separated by commas then.
  /** A line that begins with this text is a comment. Empty: there are no comments. */
  std::string comment = "#";
  /** The names of the columns, if the file does not begin with them. */
  std::vector<std::string> header;
};

/** How often something was found, and where first. */
struct Finding {
  std::int64_t count = 0;
  int first_line = 0;
  std::string first;  ///< What stood there; it may be empty.

  void Add(int line, const std::string& what = "");
};

struct LogTable {
  std::string path;
  /** One row for each row of the file with the header's number of fields; the wanted columns in their order. NaN where
  a field is no finite number. */
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> values;
  std::vector<int> lines;        ///< In which line each row begins.
  std::vector<bool> after_loss;  ///< Whether a row was left out directly before this one.
  /** Rows that say only which commands begin, between two rows with states (joined_logs.h). Empty: there are none. */
  std::vector<bool> is_command;
  Finding blank, comments, lost;      ///< Lines without a row, and rows left out.
  Finding headers;                    ///< Lines that repeat the header; a row is left out there.
  Finding decimal_commas;             ///< Fields of wanted columns such as 0,5, which are no number here.
  Finding dates;                      ///< Fields that are dates.
  std::vector<Finding> not_a_number;  ///< For each wanted column.

  [[nodiscard]] bool HasStates(Eigen::Index row) const {
    return is_command.empty() || !is_command[static_cast<std::size_t>(row)];
  }
  /** The rows that have states. */
  [[nodiscard]] Eigen::Index num_rows() const {
    return values.rows() - std::count(is_command.begin(), is_command.end(), true);
  }
};

/** Reads the wanted columns of a log. Cost: linear in the file.
@param wanted names of columns, or what is made of several:
    yaw_of(qx,qy,qz,qw)     the yaw of a unit quaternion, in (-pi, pi], as R = R_z(yaw) R_y R_x,
    yaw_of(qz,qw)           the same of a turn about z alone: 2 atan2(qz, qw),
    seconds_of(s,ns)        seconds and nanoseconds.
A quaternion whose length differs from 1 by more than 1 % is no number.
@throws ConfigError with file and line: the file cannot be read, has no header, names a wanted column twice or not at
all, has a second header that differs, or ends inside a quoted field; the delimiter is not clear. */
[[nodiscard]] LogTable ReadLog(const std::string& path, const std::vector<std::string>& wanted,
                               const LogFormat& format);

/** The names of a log's columns. @throws ConfigError as ReadLog does for what stands before the first row of numbers.
 */
[[nodiscard]] std::vector<std::string> LogColumns(const std::string& path, const LogFormat& format);

/** A column that somebody wants of a log: one of the log's, or what is made of several. */
class WantedColumn final {
 public:
  /** A name, yaw_of(qx,qy,qz,qw), yaw_of(qz,qw) or seconds_of(s,ns). @throws ConfigError for another
  number of arguments. */
  explicit WantedColumn(const std::string& text);

  /** The log's columns that it is made of. */
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /** Its value. NaN where one of theirs is, or they are no unit quaternion. @pre values.size() == names().size(). */
  [[nodiscard]] double Of(const std::vector<double>& values) const;

 private:
  enum class Kind { kPlain, kYaw, kHalfYaw, kSeconds };

  Kind kind_ = Kind::kPlain;
  std::vector<std::string> names_;
};

}  // namespace forereach
