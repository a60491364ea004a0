/** Comparison of a measured state with an interval, modulo whole turns for an angle. */
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

/** a + b <= c + d in real arithmetic. False if a number is NaN or infinite, or both sums are too large for a double. */
[[nodiscard]] bool SumAtMost(double a, double b, double c, double d);

/** What a measurement says of the true state, which lies within `error` of the measured one, and a set. */
enum class Conformance {
  kInside,      ///< All of measured +- error lies in the set, so the true state does.
  kConsistent,  ///< A part of it does: within the state error, the true state may lie in the set or not.
  kLeft,        ///< None of it does: the true state is outside. Also if a number is NaN, or the error is negative.
};

/** Compares measured + 2 pi j +- error with [lower, upper]; of a state that is no angle j is zero. Exact for j = 0;
otherwise the rounding of the turns counts against the state, and the better answer may be missed by some units in the
last place. @param error how far the true state may be from the measured one, not negative. */
[[nodiscard]] Conformance Conform(double measured, double error, double lower, double upper, bool is_angle);

}  // namespace forereach
