/** The largest slopes that pairs of observations show of one column alone: what the data say of an entry of L without a
linear program that shares slopes out (smallest_row.h). */
#pragma once

#include <vector>

#include "forereach/residual/declaration.h"
#include "forereach/residual/observations.h"

namespace forereach {

/** Of one column l of row k: the pairs i, j that essentially differ in it alone. In every other column of those given,
in standard deviations, they differ by at most a fifth of what they differ in l. */
struct LoneSlope {
  int pairs = 0;
  /** The largest (|r~_ik - r~_jk| - 2 eps) / |z_il - z_jl| of them, at least 0. Differences in the other columns may
  have a part in it, so it is no bound on L_kl, neither from below nor from above. */
  double slope = 0;
  int first = 0, second = 0;  ///< Its pair, if it is positive.

  static constexpr double kOthers = 0.2;
};

/** An entry for each column of z; those that are not given have no pairs. @param declaration its sigma and disturbance
make eps. Takes at most 2000 observations, evenly chosen, and all their pairs. */
[[nodiscard]] std::vector<LoneSlope> FindLoneSlopes(const Declaration& declaration, const Observations& observations,
                                                    int coordinate, const std::vector<int>& columns);

}  // namespace forereach
