/** Where and when a candidate begins. */
#pragma once

#include <cstdint>

#include "forereach/sets/eigen.h"

namespace forereach {

/** X_0 = {x : |x - center| <= half_width}, where the robot is expected at `utime`; n entries each. */
struct CandidateStart {
  std::int64_t utime;  ///< Of the first control: a boundary of the robot's steps, microseconds since the Unix epoch.
  Eigen::VectorXd center, half_width;
};

}  // namespace forereach
