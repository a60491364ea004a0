/** The plans of a policy, with the obstacles of their certification and the places of their observations.

The nominal model, target, declaration, domain, initial-set widths and obstacle are the bicycle's; the horizon is a
block's, 20 steps. Ours are:
- **Policy**: one for all seeds, config/policies/bicycle.json; a seed draws errands (demonstrations.h) that it was not
  trained on. X0 is about the state in which the policy was asked.
- **Obstacle**: the bicycle's (scenarios.h), at step k ~ U{9..12} as there. The paper's certificate rates are two thirds
of its recalls in every row, so two thirds of its plans are target-safe: here all of A, and the even ones of B and C.
- **Fixed grid**: N points over the bicycle's data region, v in [7.25, 15.75] by delta in [0, 0.45], ends included, as
many lines of v as the largest divisor of N up to its root; every other coordinate is zero. The same for all seeds.
- **Policy corridor**: N points (x_t, u_t) on nominal rollouts of further blocks, the groups in turn, t ~ U{0..19}. */
#pragma once

#include "planner_bridge/policy.h"
#include "research/scenarios.h"

namespace forereach::research {

/** "bicycle_chunks": the bicycle with a horizon of 20. */
[[nodiscard]] const System& ChunkSystem();

/** The checked-in policy, read when it is first asked for. @throws PolicyError. */
[[nodiscard]] const Policy& ShippedPolicy();

/** Plan `index` of a group; seeds count from 0. @throws PolicyError. */
[[nodiscard]] Scenario MakeChunkScenario(Group group, int seed, int index);

/** @name Points z of the bicycle to observe, a row each. */
///@{
[[nodiscard]] Eigen::MatrixXd GridPoints(int count);
[[nodiscard]] Eigen::MatrixXd PolicyPoints(int seed, int count);
///@}

}  // namespace forereach::research
