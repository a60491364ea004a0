/** Comparison of a state with an interval, modulo whole turns for an angle. */
#pragma once

#include <bitset>
#include <span>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** The states that are angles, by their indices: values that differ by a multiple of 2 pi are the same. */
using Angles = std::bitset<16>;

/** @throws std::invalid_argument if an index is negative or not below `num_states`. */
[[nodiscard]] Angles AnglesOf(std::span<const int> states, int num_states);

/** An interval; a single point that is a double has equal ends. */
struct Ends {
  double lower, upper;
};

/** An interval that contains value + 2 pi j for one whole number j: the one that brings it nearest to the middle of
[lower, upper], up to rounding. It is the point `value` itself where that is inside or j is zero; otherwise it is as
wide as j units in the last place of 2 pi and two of the result. NaN stays NaN. */
[[nodiscard]] Ends TurnTowards(double value, double lower, double upper);

/** True only if value + 2 pi j lies in [lower, upper] for some whole number j, or, of a state that is no angle, for
j = 0. Exact for j = 0; otherwise a distance from the ends of some units in the last place is needed. NaN lies nowhere.
*/
[[nodiscard]] bool LiesWithin(double value, double lower, double upper, bool is_angle);

}  // namespace forereach
