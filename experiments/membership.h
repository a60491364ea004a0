/** Whether a zonotope contains a point: the linear program  exists b, |b|_inf <= 1, G b = x - c  without a solver.
In plain arithmetic and to a tolerance, so for figures, not for bounds. */
#pragma once

#include <span>

#include "certifier/sets/zonotope.h"

namespace forereach::experiments {

enum class Membership { kInside, kOutside, kUndecided };

/** Minimizes |x - c - G b|_2 over the cube by cyclic descent from the shortest solution without bounds, coordinates in
units of the hull's half-widths. Inside: the rest fell below 1e-9. Outside: the rest is a direction d with
d.(x - c) > |G^T d|_1, which separates. Undecided: neither within 5000 rounds. Cost O(n m) a round. */
[[nodiscard]] Membership Locate(const Zonotope& set, std::span<const double> x);

}  // namespace forereach::experiments
