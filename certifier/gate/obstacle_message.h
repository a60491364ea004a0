/** Obstacles to and from the bus. */
#pragma once

#include <vector>

#include "certifier/safety/obstacle.h"
#include "forereach/obstacles_t.hpp"

namespace forereach {

/** @throws std::invalid_argument naming the obstacle and what is wrong with it, also if its dimension is not `dim`. */
[[nodiscard]] std::vector<Obstacle> FromMessage(const obstacles_t& message, int dim);

/** @pre at most kMaxObstacles. */
[[nodiscard]] obstacles_t ToMessage(const std::vector<Obstacle>& obstacles);

}  // namespace forereach
