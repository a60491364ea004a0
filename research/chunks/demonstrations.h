/** The training data of the policy: errands, and the expert's actions on them.

The paper says: an expert tracks a feasible nominal reference, straight for group A, arced for B and C; 12 inputs, 20
steps of 2 controls. The rest is ours:
- **References** (planner_bridge/reference.h): constant speed v ~ U[9, 15] m/s, straight in A; v ~ U[10, 15] in B and C,
  along the arc whose lateral acceleration v^2 tan(delta) / wheelbase is U[8, 13] m/s^2, where tyres saturate above
  8.83: to the left in C, to the right in B.
- **Starts**: the reference's, off by up to (0.2, 0.2, 0.05, 0.3, 0.2, 0.02) in each coordinate.
- **Cruise**: errands of a slow robot on its way to a goal, which a planner needs and the paper's groups do not have. */
#pragma once

#include <cstdint>

#include "planner_bridge/reference.h"
#include "research/chunks/ilqr.h"
#include "research/random.h"
#include "research/scenarios.h"

namespace forereach::research {

inline constexpr int kBlockSteps = 20;

/** A state in which a policy acts, with the reference that it follows. */
struct Errand {
  Eigen::VectorXd state;
  Reference reference;
};

[[nodiscard]] Errand DrawErrand(Group group, Random& random);
[[nodiscard]] Errand DrawCruise(Random& random);

[[nodiscard]] const TrackingWeights& ExpertWeights();

/** The expert's controls, 2-by-20, |jerk| <= 10 and |steering rate| <= 1. */
[[nodiscard]] Eigen::MatrixXd Demonstrate(const Errand& errand);

/** A column for each errand. */
struct Demonstrations {
  Eigen::MatrixXd features;  ///< 12 rows
  Eigen::MatrixXd blocks;    ///< 40 rows, the controls of one step next to each other
};

/** In turn from A, B, C and three times cruise. Those of a smaller count are the first of a larger.
Cost: some 0.5 ms each, on `threads` threads; the result does not depend on them. */
[[nodiscard]] Demonstrations MakeDemonstrations(int count, std::uint64_t seed, unsigned threads);

}  // namespace forereach::research
