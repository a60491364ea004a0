/** The observed one-step transitions D_N = {(z_i, x_i+)}, z = (x, u). */
#pragma once

#include "forereach/sets/eigen.h"

namespace forereach {

struct Transitions {
  Eigen::MatrixXd z;       ///< N-by-d_z: one row z_i each, the state and then the input, in the model's units.
  Eigen::MatrixXd x_next;  ///< N-by-n: the observed successor x_i+ of each row.

  /** By how much each step lasted longer or shorter than dt, at most, in seconds; none: all lasted dt. */
  Eigen::VectorXd longer = {};

  /** So many of the last rows were learned on a bus: the declared errors of what is recorded are theirs. */
  int num_learned = 0;

  [[nodiscard]] bool IsLearned(Eigen::Index row) const { return row >= z.rows() - num_learned; }
  /** That of one row. */
  [[nodiscard]] double Longer(Eigen::Index row) const { return longer.size() == 0 ? 0 : longer[row]; }
  [[nodiscard]] int size() const { return static_cast<int>(z.rows()); }
};

}  // namespace forereach
