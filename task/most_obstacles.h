/** How many obstacles a task file may have, and a set on the bus. A message has at most kMaxObstacles
(numerics/limits.h). */
#pragma once

namespace forereach {

inline constexpr int kMostObstacles = 4096;

}  // namespace forereach
