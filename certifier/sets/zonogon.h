/** Zonotopes in the plane: their outline, and how far they reach from their center. */
#pragma once

#include <vector>

#include "certifier/sets/eigen.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

/** The corners of a planar zonotope, counter-clockwise, by plain arithmetic: for pictures, not for bounds.
One corner for a point, two for a segment. Cost O(m log m). @pre set.dim() == 2 */
[[nodiscard]] std::vector<Eigen::Vector2d> Outline(const Zonotope& set);

/** An upper bound on R = max {|y - c|_2 : y in <c, G>}, Eq. (safety-radius-margin). Within 1e-11 of exact, relatively,
in the plane; the half-diagonal of the interval hull in other dimensions. Cost O(m log m). */
[[nodiscard]] double RadiusUpper(const Zonotope& set);

}  // namespace forereach
