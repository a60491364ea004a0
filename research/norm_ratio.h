/** How much of the dynamics the nominal model takes off the residual's declaration. */
#pragma once

#include "research/systems.h"

namespace forereach::research {

/** sup |D_z f0| over the domain, entry by entry, n-by-d_z: the largest over five values of each coordinate, ends and
middle included. That is where both models have it. */
[[nodiscard]] Eigen::MatrixXd LargestSlopes(const System& system);

/** |L_f|_F / |L_r|_F with L_f = sup |D_z f0| + L_r, entry by entry. The supremum is the largest value on a grid of five
points a coordinate over the domain's box, which has the corners and theta = +-pi/2, where both systems attain it. In
plain arithmetic: a figure, not a bound. Cost 5^d_z linearizations. */
[[nodiscard]] double NormRatio(const System& system, const Eigen::MatrixXd& lipschitz);

}  // namespace forereach::research
