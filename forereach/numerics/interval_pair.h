/** Two intervals [a, b] and [c, d] side by side in a vector, {-a, b, -c, d}. Every entry is an upper bound, so all four
are rounded outward by the same operation.

The bounds hold for operands below kModerate in size. A caller checks every result by IsModerate, which NaN fails, and
gives up where one is not. Results are up to a unit in the last place wider than those of interval.h. */
#pragma once

#include "forereach/numerics/interval.h"
#include "forereach/numerics/lanes.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

/** Products of three numbers below this, and sums of all products that a step makes of them, do not overflow. */
inline constexpr double kModerate = 0x1p300;

/** Above any error by underflow. What it is multiplied with leaves it a normal number: processors multiply subnormal
ones slowly. */
inline constexpr double kAboveUnderflow = 0x1p-400;

FOREREACH_INLINE Lanes PairOf(const Interval& one, const Interval& other) {
  return Lanes{-one.lower, one.upper, -other.lower, other.upper};
}
/** The interval that is stored there, half a pair. */
FOREREACH_INLINE Interval LoadInterval(const double* from) { return {-from[0], from[1]}; }

FOREREACH_INLINE LaneMask IsModerate(const Lanes& x) { return Abs(x) < AllLanes(kModerate); }

/** {b, -a, d, -c}: the intervals of the negatives. */
FOREREACH_INLINE Lanes Swapped(const Lanes& x) { return __builtin_shufflevector(x, x, 1, 0, 3, 2); }

/** Sums rounded up: x + 2^-52 |x| is at least the next double above x, and a sum that is subnormal is exact. */
FOREREACH_INLINE Lanes SumUp(const Lanes& x) { return x + Abs(x) * AllLanes(0x1p-52); }
/** Products and quotients rounded up, likewise; or a result of several roundings whose relative error is below half of
`relative`. */
FOREREACH_INLINE Lanes ProductUp(const Lanes& x, double relative = 0x1p-52) {
  return x + (Abs(x) * AllLanes(relative) + AllLanes(kAboveUnderflow));
}

FOREREACH_INLINE Lanes Plus(const Lanes& a, const Lanes& b) { return SumUp(a + b); }

/** The largest of all products of the ends. With x = -a_i b_i in the first of two lanes and a_i b_i in the second, and
y the same for a_i and the other end of b, those in the other lane are the negatives. */
FOREREACH_INLINE Lanes Times(const Lanes& a, const Lanes& b) {
  const Lanes turned = FromBits(Bits(a) ^ LaneMask{INT64_MIN, 0, INT64_MIN, 0});
  const Lanes x = turned * b, y = -(turned * Swapped(b));
  return ProductUp(Max(Max(x, y), -Swapped(Min(x, y))));
}

/** {1 / x}. Infinite where an interval holds 0. */
FOREREACH_INLINE Lanes Reciprocal(const Lanes& x) {
  const Lanes other = Swapped(x);
  return x * other < AllLanes(0) ? ProductUp(AllLanes(-1) / other) : AllLanes(kInfinity);
}

/** {x^2}. */
FOREREACH_INLINE Lanes SquareOf(const Lanes& x) { return Min(Times(x, x), Lanes{0, kInfinity, 0, kInfinity}); }

}  // namespace forereach

FOREREACH_ARITHMETIC_END
