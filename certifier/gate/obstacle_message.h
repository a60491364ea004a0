/** Conversion between obstacles and messages. */
#pragma once

#include <vector>

#include "certifier/safety/obstacle.h"
#include "forereach/obstacles_t.hpp"

namespace forereach {

/** The obstacles of a message. @throws std::invalid_argument with the obstacle's index and its error if an obstacle is
invalid or its dimension is not `dim`. */
[[nodiscard]] std::vector<Obstacle> FromMessage(const obstacles_t& message, int dim);

/** @pre at most kMaxObstacles. */
[[nodiscard]] obstacles_t ToMessage(const std::vector<Obstacle>& obstacles);

}  // namespace forereach
