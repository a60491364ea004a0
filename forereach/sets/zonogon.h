/** Outline and radius of zonotopes. */
#pragma once

#include <vector>

#include "forereach/sets/eigen.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

/** The corners of a planar zonotope, counter-clockwise, in plain arithmetic. Use them for pictures, not for bounds.
A point has one corner, a segment two. Cost O(m log m) for m generators. @pre set.dim() == 2 */
[[nodiscard]] std::vector<Eigen::Vector2d> Outline(const Zonotope& set);

/** An upper bound on the radius R = max {|y - c|_2 : y in <c, G>} in metres, Eq. (safety-radius-margin). In the plane
its relative error is at most 1e-11. In other dimensions it is the half-diagonal of the interval hull. Cost O(m log
m). */
[[nodiscard]] double RadiusUpper(const Zonotope& set);

}  // namespace forereach
