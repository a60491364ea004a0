/** Upper bounds on all sizes, so that the certify step needs no heap. They are the limits of the bus messages
(docs/bus.md). */
#pragma once

#include "forereach/numerics/compilation.h"

namespace forereach {

inline constexpr int kMaxStates = 16;
inline constexpr int kMaxInputs = 8;
inline constexpr int kMaxVariables = kMaxStates + kMaxInputs;  ///< d_z
inline constexpr int kMaxSteps = 128;                          ///< T
inline constexpr int kMaxObstacles = 64;
inline constexpr int kMaxObstaclePoints = 16;
inline constexpr int kMaxSafetyDim = 3;  ///< p
inline constexpr int kMaxBodyParts = 16;
inline constexpr int kMaxBodyPoints = 16;  ///< of all parts together
/** Columns of [J G, diag(q), diag(h)]: an order-5 zonotope in 16 states has 81 with that of a step's offset, its
successor 113. */
inline constexpr int kMaxGenerators = 120;

}  // namespace forereach
