/** The supplied side information, Assumption 1: |r_k(z) - r_k(z')| <= sum_l L_kl |z_l - z'_l|, and the noise bound. */
#pragma once

#include "certifier/sets/eigen.h"

namespace forereach {

struct Declaration {
  Eigen::MatrixXd lipschitz;    ///< L, n-by-d_z, not negative. A zero row declares a constant residual coordinate.
  Eigen::VectorXd noise_bound;  ///< sigma, n entries, not negative, state units.

  /** @throws std::invalid_argument naming the entry if a size is not n-by-d_z or n, or an entry negative or not finite.
   */
  void Validate(int num_states, int num_variables) const;
};

}  // namespace forereach
