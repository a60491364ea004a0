/** Observed residuals, Eq. (data): r~_i = x_i+ - f0(z_i), enclosed.

A recorded successor is a rounded number, known to its last bit only: one unit in the last place of it counts as
observation error on top of sigma. So [lower, upper] contains x_i+ - f0(z_i) +- ulp(x_i+), and every admissible residual
satisfies  lower_ik - sigma_k <= r_k(z_i) <= upper_ik + sigma_k. */
#pragma once

#include "certifier/dynamics/model.h"
#include "certifier/residual/transitions.h"
#include "certifier/sets/eigen.h"

namespace forereach {

struct Observations {
  Eigen::MatrixXd z;             ///< N-by-d_z
  Eigen::MatrixXd lower, upper;  ///< N-by-n: enclosures of the observed residuals

  [[nodiscard]] int size() const { return static_cast<int>(z.rows()); }
  [[nodiscard]] int num_states() const { return static_cast<int>(lower.cols()); }
};

/** @throws std::invalid_argument if there are none, a size does not fit the model, a number is not finite, or f0 has no
finite enclosure at a recorded location; names the row. */
[[nodiscard]] Observations Observe(const NominalModel& model, const Transitions& transitions);

}  // namespace forereach
