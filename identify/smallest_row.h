/** The smallest row of L that a set of observations does not contradict: a linear program.

Row k of L with columns L_kl is consistent with observations of which each errs by at most eps if for all pairs i, j
    sum_l L_kl |z_il - z_jl| >= |r~_ik - r~_jk| - 2 eps.                                              (pairs)
A pair bounds one entry from below only if the others are known or do not count in it. All pairs together bound the sum
of s_l L_kl for any s_l >= 0: the smallest value of that sum over all consistent rows is one that the true row reaches
or exceeds. The program finds it, with the row where it is. This is a fact about the data and proves no upper bound. */
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "forereach/residual/declaration.h"
#include "forereach/residual/observations.h"

namespace forereach {

/** Two observations: the residuals differ by at least `difference` = |r~_ik - r~_jk| - 2 eps. */
struct ObservedPair {
  int first = 0, second = 0;
  double difference = 0;
};

struct SmallestRow {
  Eigen::RowVectorXd slopes;  ///< d_z entries, not negative
  /** For each column with a slope: a pair whose inequality is tight and in which this column counts most. */
  std::vector<std::optional<ObservedPair>> reasons;
  /** No row is consistent: two observations that agree in all columns with a free or positive slope differ by more than
  2 eps. */
  std::optional<ObservedPair> unexplained;
  int rounds = 0;
};

/** Minimises sum_l s_l L_kl over the consistent rows. Cuts are added until no pair violates (pairs), and the row is
then scaled up, by a factor close to 1, until FindViolation finds nothing either, whose arithmetic is rigorous.
@param declaration its sigma and disturbance make eps; its row k gives the fixed slopes. @param scales s_l, d_z entries:
positive for a column that is free, not positive for one that keeps the declaration's slope.
Cost: some tens of rounds, each about N descents of a search tree and a small linear program. */
[[nodiscard]] SmallestRow FindSmallestRow(const Declaration& declaration, const Observations& observations,
                                          int coordinate, const Eigen::RowVectorXd& scales);

/** The scatter of coordinate k: the error e beyond the declaration's eps that residuals of near places show. It
minimises sum_l s_l L_kl + (2 / kNearby) e over e >= 0 and the rows that are consistent with the error eps + e. A pair
at a distance d, as above, asks for slopes of its difference over d, or for half its difference: so e explains near
pairs, and slopes the others. No pair contradicts the row that FindSmallestRow finds with the error eps + e.
@return e, zero if slopes explain near pairs as well. Arguments and cost as for FindSmallestRow. */
[[nodiscard]] double FindScatter(const Declaration& declaration, const Observations& observations, int coordinate,
                                 const Eigen::RowVectorXd& scales);

/** The smallest entry L_kl if the other entries of row k are at most the declaration's: the declaration's own row has
to be consistent. If it bounds the true row from above in the other columns, this is a lower bound on the true entry. */
[[nodiscard]] SmallestRow FindSmallestEntry(const Declaration& declaration, const Observations& observations,
                                            int coordinate, int column);

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
