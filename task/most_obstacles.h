/** How many obstacles a task file may have. A message has at most kMaxObstacles (numerics/limits.h). */
#pragma once

namespace forereach {

inline constexpr int kMostObstacles = 4096;

}  // namespace forereach
