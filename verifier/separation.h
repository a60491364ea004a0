/** Lower bounds on the distance from what the body sweeps to an obstacle, from directions evaluated in high precision.

For every direction d:   min {d . w : w in core} - max {d . y : y in sweep} <= |d|_2 * distance(core, sweep),
where the maximum over a hull is the largest over its places. The direction of the nearest point of {core - sweep}
maximises the left side. Wolfe's algorithm finds it with the bits of Precision, so it separates every pair of sets that
doubles can separate. */
#pragma once

#include <vector>

#include "forereach/safety/obstacle.h"
#include "verifier/answer.h"
#include "verifier/sweep.h"

namespace forereach::verifier {

/** Whether the distance from a sweep to an obstacle is positive and at least `clearance` (metres). kYes is a proof. kNo
means that the best direction gives no proof. @param best is set to the largest lower bound found.
@pre passage.is_there. The obstacle's motion is that of `passage`. */
[[nodiscard]] Answer IsClear(const Sweep& sweep, const Obstacle& obstacle, double clearance, Real& best,
                             const Passage& passage = {});

/** Whether a sweep in the plane lies inside of rings: it is connected, meets none of their sides, and the rings go an
odd number of times around one of its points. @param margin is set to the largest lower bound found on its distance from
the sides, or to 0 if the point is outside. */
[[nodiscard]] Answer IsWithin(const Sweep& sweep, const std::vector<std::vector<Eigen::Vector2d>>& rings, Real& margin);

}  // namespace forereach::verifier
