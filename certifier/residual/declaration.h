/** The declared bounds on the residual: Assumption 1, |r_k(z) - r_k(z')| <= sum_l L_kl |z_l - z'_l| for all z, z' in
Z_cert, Eq. (regularity), and the bound sigma on the observation error, Eq. (data). */
#pragma once

#include "certifier/sets/eigen.h"

namespace forereach {

struct Declaration {
  Eigen::MatrixXd
      lipschitz;  ///< L, n-by-d_z, not negative; unit of state k per unit of z_l. A zero row: r_k is constant.
  Eigen::VectorXd noise_bound;  ///< sigma, n entries, not negative, in the units of the states.

  /** @throws std::invalid_argument if L is not n-by-d_z, sigma has not n entries, or an entry is negative or not
  finite; the message names the entry. */
  void Validate(int num_states, int num_variables) const;
};

}  // namespace forereach
