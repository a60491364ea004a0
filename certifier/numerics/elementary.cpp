// Ranges of the trigonometric functions.
//
// Each function is monotone between its extrema, so its range over an interval is spanned by the values at the ends and
// by the extrema inside. The values come from the C library, whose results are within one unit in the last place of the
// exact value (glibc's manual, "Known Maximum Errors"); we widen by two. Extrema are found by comparison with
// enclosures of multiples of pi. If the comparison is undecided, the extremum counts as inside, which can only widen
// the range.
#include "certifier/numerics/interval.h"

namespace forereach {
namespace {

constexpr Interval kPi(0x1.921fb54442d18p+1, 0x1.921fb54442d19p+1);
constexpr double kLargestArgument = 0x1p20;

// Whether x may contain (offset + j * period) * pi / 2 for some integer j.
bool MayContain(const Interval& x, double offset, double period) {
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

}  // namespace

Interval sin(const Interval& x) {
  if (!Reducible(x)) return {-1, 1};
  return WaveRange(x, std::sin(x.lower), std::sin(x.upper), 1, -1);
}

Interval cos(const Interval& x) {
  if (!Reducible(x)) return {-1, 1};
  return WaveRange(x, std::cos(x.lower), std::cos(x.upper), 0, 2);
}

Interval tan(const Interval& x) {
  if (!Reducible(x) || MayContain(x, 1, 2)) return Interval::Entire();
  return {WidenDown(std::tan(x.lower)), WidenUp(std::tan(x.upper))};
}

}  // namespace forereach
