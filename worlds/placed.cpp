#include "worlds/placed.h"

#include <algorithm>
#include <cmath>

namespace forereach {

Placed Place(const std::vector<PlanePoint>& points, const Pose& pose) {
  // Sine and cosine are within 2^-52 (docs/soundness.md, 3.9), and each of the two products and two sums rounds by
  // 2^-53 of its result at most: less than 2^-49 of all sizes in each coordinate.
  constexpr double kRelative = 0x1p-48;
  Placed placed;
  const double cosine = std::cos(pose.yaw), sine = std::sin(pose.yaw);
  for (const auto& [x, y] : points) {
    placed.points.push_back({cosine * x - sine * y + pose.x, sine * x + cosine * y + pose.y});
    const double size = std::abs(x) + std::abs(y) + std::abs(pose.x) + std::abs(pose.y);
    placed.error = std::max(placed.error, kRelative * size);
  }
  return placed;
}

}  // namespace forereach
