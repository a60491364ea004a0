/** Whether a zonotope contains a point: exists b, |b|_inf <= 1, G b = x - c.
In plain arithmetic and to a tolerance, so for figures, not for bounds. */
#pragma once

#include <span>

#include "forereach/sets/zonotope.h"

namespace forereach::research {

enum class Membership { kInside, kOutside, kUndecided };

/** Minimizes |x - c - G b|_2 over the cube by cyclic descent from the shortest solution without bounds, coordinates in
units of the hull's half-widths. Inside: the rest fell below 1e-9. Outside: the rest is a direction d with
d.(x - c) > |G^T d|_1, which separates. Where neither holds after 200 rounds, of O(n m) each, a linear program gives b
and d, which are held against the same two tests: no word of the solver is taken. Undecided: they pass neither. */
[[nodiscard]] Membership Locate(const Zonotope& set, std::span<const double> x);

}  // namespace forereach::research
