/** Lower bounds on the distance from what the body sweeps to an obstacle, from directions evaluated in high precision.

For every direction d:   min {d . w : w in core} - max {d . y : y in sweep} <= |d|_2 * distance(core, sweep),
where the maximum over a hull is the largest over its places. The direction of the nearest point of {core - sweep}
maximises the left side. Wolfe's algorithm finds it with the bits of Precision, so it separates every pair of sets that
doubles can separate. */
#pragma once

#include <span>

#include "forereach/safety/obstacle.h"
#include "verifier/answer.h"
#include "verifier/sweep.h"

namespace forereach::verifier {

/** Whether the distance to an obstacle of something that lies in every one of the sweeps is positive and at least
`clearance` (metres): one that is clear is enough, of a grid for each cell. kYes is a proof. kNo means that the best
direction gives no proof; without sweeps it is kUnknown. @param best is set to the largest lower bound found; of a grid,
to the least of those for its cells.
@pre passage.is_there. The obstacle's motion is that of `passage`. */
[[nodiscard]] Answer IsClear(std::span<const Sweep> sweeps, const Obstacle& obstacle, double clearance, Real& best,
                             const Passage& passage = {});
[[nodiscard]] inline Answer IsClear(const Sweep& sweep, const Obstacle& obstacle, double clearance, Real& best,
                                    const Passage& passage = {}) {
  return IsClear(std::span(&sweep, 1), obstacle, clearance, best, passage);
}

/** Whether what lies in every one of the sweeps in the plane, of SweepsOf, is inside of rings: it is connected, it is
clear of each of their sides, and the rings go an odd number of times around one of its points; without sweeps it is
kUnknown. @param margin is set to the largest lower bound found on its distance from the sides, or to 0 if the point is
outside. */
[[nodiscard]] Answer IsWithin(std::span<const Sweep> sweeps, const std::vector<std::vector<Eigen::Vector2d>>& rings,
                              Real& margin);

}  // namespace forereach::verifier
