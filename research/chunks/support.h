/** How far a plan is from the data, independently of any certificate, and whether abstention follows it. */
#pragma once

#include <optional>
#include <vector>

#include "forereach/residual/transitions.h"
#include "research/scenarios.h"

namespace forereach::research {

/** d = max_t min_i |(x_t - x_i) / system.support_scale|_2, x_0..x_T the nominal rollout from the middle of X0 and x_i
the states that were observed. Cost O(T N n). */
[[nodiscard]] double DistanceToData(const System& system, const Scenario& scenario, const Transitions& data);

/** A plan's d, and whether it got no certificate. */
struct SupportRecord {
  double distance;
  bool abstained;
};

struct SupportStatistic {
  std::optional<double> spearman;    ///< Rank correlation of d and abstention; none where either never changes
  double nearest = 0, farthest = 0;  ///< Abstention rates of the quarters of records with the least and the largest d
  [[nodiscard]] double gap() const { return farthest - nearest; }
};

/** Equal values share the mean of their ranks; quarters of n records have n / 4 each, rounded down.
@pre at least 4 records. */
[[nodiscard]] SupportStatistic SupportOf(std::vector<SupportRecord> records);

}  // namespace forereach::research
