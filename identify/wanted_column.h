/** A column that somebody wants of a log: one of the log's, or what is made of several. */
#pragma once

#include <string>
#include <vector>

namespace forereach {

class WantedColumn final {
 public:
  /** A name, yaw_of(qx,qy,qz,qw), yaw_of(qz,qw) or seconds_of(s,ns), as in log_table.h. @throws ConfigError for another
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
