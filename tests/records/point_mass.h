/** A task whose log a test makes by hand, and its plans. */
#pragma once

#include "task/config.h"
#include "tests/records/logs.h"
#include "tests/worlds.h"

namespace forereach {

/** A point mass without residual, and one circle at (3, 0). */
inline Config PointMassConfig() {
  Config config;
  config.problem =
      std::make_shared<const Problem>(WorldOf(MakePointMass(0.15), Within({20, 20, 20, 20}), Within({1, 1})));
  config.obstacles = {Obstacle::Circle(Eigen::Vector2d(3, 0), 0.5)};
  config.planner.goal = {0, 5};
  return config;
}

/** Ten steps from the origin at 3 m/s along x, into the circle, or along y. */
inline candidate_plan_t Drive(std::int64_t plan_id, bool along_x) {
  candidate_plan_t candidate = MakeCandidate(plan_id, plan_id);
  candidate.num_states = 4;
  candidate.num_inputs = 2;
  candidate.num_steps = 10;
  candidate.initial_center[along_x ? 2 : 3] = 3;
  candidate.initial_half_width[0] = candidate.initial_half_width[1] = 0.1;
  return candidate;
}

}  // namespace forereach
