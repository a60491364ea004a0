/** Enclosures of the observed residuals r~_i = x_i+ - f0(z_i), Eq. (data).

A recorded successor is a rounded number. One unit in its last place counts as observation error in addition to sigma.
So [lower, upper] contains x_i+ - f0(z_i) +- ulp(x_i+), and every admissible residual satisfies lower_ik - eps_k <=
r_k(z_i)
<= upper_ik + eps_k, eps_k = Declaration::ObservationError. */
#pragma once

#include "certifier/dynamics/model.h"
#include "certifier/residual/transitions.h"
#include "certifier/sets/eigen.h"

namespace forereach {

struct Observations {
  Eigen::MatrixXd z;             ///< N-by-d_z: the locations z_i, one row each
  Eigen::MatrixXd lower, upper;  ///< N-by-n: enclosures of the observed residuals, in the units of the states

  [[nodiscard]] int size() const { return static_cast<int>(z.rows()); }
  [[nodiscard]] int num_states() const { return static_cast<int>(lower.cols()); }
};

/** Computes the observations from transitions. @throws std::invalid_argument if there are none, a size does not match
the model, a number is not finite, or f0 has no finite enclosure at a location; the message names the row. Cost O(N). */
[[nodiscard]] Observations Observe(const NominalModel& model, const Transitions& transitions);

}  // namespace forereach
