/** The two systems of the noise floor: f* + shift and f* - shift, |shift_k| = sigma_k. With the errors -shift and
+shift both give the observations of f* without noise, and both have the slopes of f*'s residual, so whoever sees only
the data and a declaration with that sigma cannot tell them apart: a sound tube contains both. */
#pragma once

#include "research/systems.h"
#include "research/table.h"

namespace forereach::research {

/** x_0 .. x_T of f* + shift from a state as columns. In plain arithmetic. */
[[nodiscard]] Eigen::MatrixXd ShiftedRollout(const System& system, const Eigen::VectorXd& start,
                                             const Eigen::MatrixXd& controls, const Eigen::VectorXd& shift);

struct NoiseFloor {
  double half_distance;  ///< |P (x_T^+ - x_T^-)| / 2, the largest over the signs of the shift
  double half_width;     ///< Of ForeReach's tube at T; not a number if it is not complete
  int escapes;           ///< Of the states of all pairs, those provably outside the tube
};

/** For one plan in the corridor, the largest N, X_0 a point. */
[[nodiscard]] NoiseFloor FindNoiseFloor(const System& system, double sigma);

[[nodiscard]] Table NoiseFloorTable();

}  // namespace forereach::research
