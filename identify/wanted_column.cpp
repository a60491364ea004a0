#include "identify/wanted_column.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include "task/config_error.h"
#include "task/line_reader.h"

namespace forereach {

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
    throw ConfigError(text + ": has to be yaw_of(qx,qy,qz,qw), or yaw_of(qz,qw) of a turn about z alone");
  if (function == "seconds_of" && count != 2) throw ConfigError(text + ": has to be seconds_of(SECONDS,NANOSECONDS)");
  kind_ = function == "seconds_of" ? Kind::kSeconds : count == 2 ? Kind::kHalfYaw : Kind::kYaw;
  names_ = std::move(arguments);
}

double WantedColumn::Of(const std::vector<double>& v) const {
  const auto if_unit = [](double square, double yaw) {
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
