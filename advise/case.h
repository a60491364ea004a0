/** A plan with everything that it was judged by, so that it can be judged again after a change. */
#pragma once

#include <memory>
#include <vector>

#include "forereach/certify/decision.h"
#include "forereach/certify/problem.h"
#include "forereach/safety/obstacle.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

struct Case {
  std::shared_ptr<const Problem> problem;  ///< With everything learned until then among its transitions.
  Eigen::MatrixXd controls;                ///< m-by-T, a column a step
  Schedule schedule{};
  Zonotope initial_set;  ///< X_0
  std::vector<Obstacle> obstacles;
  int progress_steps = -1;  ///< The number of controls before the braking tail; -1 if it is not known.

  /** Refers to `controls`. */
  [[nodiscard]] Plan plan() const {
    const auto inputs = static_cast<int>(controls.rows());
    return {controls.data(), inputs, static_cast<int>(controls.cols()), inputs, schedule};
  }
};

}  // namespace forereach
