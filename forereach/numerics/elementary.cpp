// Ranges of the trigonometric functions and their inverses.
//
// Each of sin, cos and tan is monotone between its extrema, so its range over an interval is spanned by the values at
// the ends and by the extrema inside. The values come from the C library, whose results are within one unit in the last
// place of the exact value (glibc's manual, "Known Maximum Errors"); we widen by two. Extrema are found by comparison
// with enclosures of multiples of pi. If the comparison is undecided, the extremum counts as inside, which can only
// widen the range. The inverse functions are monotone, atan2 in each argument.
#include "forereach/numerics/elementary.h"

#include <algorithm>
#include <cmath>

namespace forereach {
namespace {

constexpr Interval kPi(0x1.921fb54442d18p+1, 0x1.921fb54442d19p+1);
constexpr double kPiUp = kPi.upper, kHalfPiUp = kPiUp / 2;
constexpr double kLargestArgument = 0x1p20;

// Whether x may contain (offset + j * period) * pi / 2 for some integer j. Plain arithmetic decides if it is not close:
// up to the largest argument its error is below 2^-31 turns.
bool MayContain(const Interval& x, double offset, double period) {
  constexpr double kPerQuarterTurn = 0x1.45f306dc9c883p-1, kClose = 0x1p-29;
  const double first = (x.lower * kPerQuarterTurn - offset) / period,
               last = (x.upper * kPerQuarterTurn - offset) / period;
  if (std::ceil(first - kClose) > last + kClose) return false;
  if (std::ceil(first + kClose) <= last - kClose) return true;
  const Interval turns = (x - Interval(offset / 2) * kPi) / (Interval(period / 2) * kPi);
  return !(std::ceil(turns.lower) > turns.upper);
}

// maximum_at, minimum_at: where the function is 1 and -1, in units of pi / 2.
Interval WaveRange(const Interval& x, double at_lower, double at_upper, double maximum_at, double minimum_at) {
  Interval range(WidenDown(std::min(at_lower, at_upper)), WidenUp(std::max(at_lower, at_upper)));
  if (MayContain(x, maximum_at, 4)) range.upper = 1;
  if (MayContain(x, minimum_at, 4)) range.lower = -1;
  return {std::max(range.lower, -1.0), std::min(range.upper, 1.0)};
}

bool Reducible(const Interval& x) { return x.Magnitude() <= kLargestArgument; }

// The range of a function with the sign of its argument, from values at its ends, in [-bound, bound].
Interval SignedRange(const Interval& x, double at_lower, double at_upper, double bound) {
  return {std::max(WidenDown(at_lower), x.lower >= 0 ? 0 : -bound),
          std::min(WidenUp(at_upper), x.upper <= 0 ? 0 : bound)};
}

bool IsCosine(const Interval& x) { return -1 <= x.lower && x.upper <= 1; }

}  // namespace

Interval sin(const Interval& x) {
  if (!x.IsFinite()) return Interval::Entire();
  if (!Reducible(x)) return {-1, 1};
  return WaveRange(x, std::sin(x.lower), std::sin(x.upper), 1, -1);
}

Interval cos(const Interval& x) {
  if (!x.IsFinite()) return Interval::Entire();
  if (!Reducible(x)) return {-1, 1};
  return WaveRange(x, std::cos(x.lower), std::cos(x.upper), 0, 2);
}

Interval tan(const Interval& x) {
  if (!Reducible(x) || MayContain(x, 1, 2)) return Interval::Entire();
  return {WidenDown(std::tan(x.lower)), WidenUp(std::tan(x.upper))};
}

Interval asin(const Interval& x) {
  if (!IsCosine(x)) return Interval::Entire();
  return SignedRange(x, std::asin(x.lower), std::asin(x.upper), kHalfPiUp);
}

Interval acos(const Interval& x) {
  if (!IsCosine(x)) return Interval::Entire();
  return {std::max(WidenDown(std::acos(x.upper)), 0.0), std::min(WidenUp(std::acos(x.lower)), kPiUp)};
}

Interval atan(const Interval& x) {
  if (!x.IsFinite()) return Interval::Entire();
  return SignedRange(x, std::atan(x.lower), std::atan(x.upper), kHalfPiUp);
}

// Beside the cut the angle increases with y where x > 0 and falls where x < 0; it falls with x where y > 0 and
// increases where y < 0. So the largest angle is at a corner: above the x-axis at the least x, below at the largest,
// and there at the y that the sign of this x asks for. A box that meets the positive x-axis has it on its upper side.
Interval atan2(const Interval& y, const Interval& x) {
  if (!cut(y, x).IsFinite()) return Interval::Entire();
  const double x_highest = y.upper > 0 ? x.lower : x.upper, x_lowest = y.lower < 0 ? x.lower : x.upper;
  const double highest = std::atan2(x_highest >= 0 ? y.upper : y.lower, x_highest);
  const double lowest = std::atan2(x_lowest >= 0 ? y.lower : y.upper, x_lowest);
  return SignedRange(y, lowest, highest, kPiUp);
}

}  // namespace forereach
