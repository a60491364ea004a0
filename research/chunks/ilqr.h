/** The expert: an iterative linear-quadratic regulator on the nominal model. */
#pragma once

#include <Eigen/Core>

#include "forereach/dynamics/model.h"
#include "forereach/sets/box.h"

namespace forereach::research {

/** Diagonals of Q, Q_T and R. State weights are not negative, input weights positive. */
struct TrackingWeights {
  Eigen::VectorXd state, last_state, input;
};

/** Controls u_0..u_{T-1} that locally minimize
    1/2 sum_{t<T} (|x_t - ref_t|_Q^2 + |u_t|_R^2) + 1/2 |x_T - ref_T|_{Q_T}^2,   x_{t+1} = f0(x_t, u_t), x_0 = start,
by Newton steps without the dynamics' second derivatives, and a line search that only accepts what costs less (Li and
Todorov 2004). Every control is cut to `inputs` where it is applied; a plan with cut controls costs no more than no
controls, but need not be a minimum. At most 60 iterations of cost O(T (n + m)^3).
@param reference n-by-(T+1), a column a state. @return m-by-T. */
[[nodiscard]] Eigen::MatrixXd Track(const NominalModel& model, const Eigen::VectorXd& start,
                                    const Eigen::MatrixXd& reference, const TrackingWeights& weights,
                                    const Box& inputs);

/** The sum above. @param states n-by-(T+1). */
[[nodiscard]] double TrackingCost(const Eigen::MatrixXd& states, const Eigen::MatrixXd& controls,
                                  const Eigen::MatrixXd& reference, const TrackingWeights& weights);

}  // namespace forereach::research
