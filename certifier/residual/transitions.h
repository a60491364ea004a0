/** The observed one-step transitions D_N = {(z_i, x_i+)}, z = (x, u). */
#pragma once

#include "certifier/sets/eigen.h"

namespace forereach {

struct Transitions {
  Eigen::MatrixXd z;       ///< N-by-d_z: state, then input.
  Eigen::MatrixXd x_next;  ///< N-by-n

  [[nodiscard]] int size() const { return static_cast<int>(z.rows()); }
};

}  // namespace forereach
