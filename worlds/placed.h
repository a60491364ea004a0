/** Points of a frame that is turned and moved, with a bound on what rounding makes of them. */
#pragma once

#include <vector>

#include "task/plane.h"

namespace forereach {

/** p -> R(yaw) p + (x, y), in metres and radians. */
struct Pose {
  double x = 0, y = 0, yaw = 0;
};

struct Placed {
  std::vector<PlanePoint> points;
  double error = 0;  ///< Each is at most so far, in metres, from where its exact one is. Not negative.
};

/** @pre finite, |yaw| <= 2^20: beyond, nothing is said of the errors of sine and cosine. */
[[nodiscard]] Placed Place(const std::vector<PlanePoint>& points, const Pose& pose);

}  // namespace forereach
