/** Ranges of elementary functions over intervals, rounded outward. sin, cos, tan and sqr are in interval.h.

Each function f returns an interval that contains {f(t) : t in x}. It returns [-inf, inf] if f is undefined anywhere on
x, and if an end of x is infinite or NaN. So a finite value of an expression made of them proves that the expression is
defined at every point of its arguments. Where f overflows, the end is infinite.

The ends are values of the C library, moved outward by more than its error (docs/soundness.md, 2), or computed with
directed rounding. No function allocates, locks or throws. */
#pragma once

#include <algorithm>

#include "forereach/numerics/interval.h"

namespace forereach {

/** {e^t}. At least 0. */
[[nodiscard]] Interval exp(const Interval& x);

/** {log t} if x > 0. */
[[nodiscard]] Interval log(const Interval& x);

/** {log(1 + t)} if x > -1. */
[[nodiscard]] Interval log1p(const Interval& x);

/** {sqrt t} if x >= 0. */
[[nodiscard]] Interval sqrt(const Interval& x);

/** {asin t} and {acos t} if x lies in [-1, 1]; inside the least doubles around [-pi/2, pi/2] and [0, pi]. */
[[nodiscard]] Interval asin(const Interval& x);
[[nodiscard]] Interval acos(const Interval& x);

/** {atan t}, inside the least doubles around [-pi/2, pi/2]. */
[[nodiscard]] Interval atan(const Interval& x);

/** The angles of the points (s, t), s in x, t in y, in (-pi, pi), if none of them lies on the cut {y = 0, x <= 0}:
there the angle jumps from pi to -pi, and the origin has none. */
[[nodiscard]] Interval atan2(const Interval& y, const Interval& x);

/** {tanh t}, inside [-1, 1]. */
[[nodiscard]] Interval tanh(const Interval& x);

/** {t^n}, t^0 = 1; for n < 0 if x does not contain 0. Where nothing underflows, the ends are within a relative 2 |n|
2^-52 of the range. Cost: 2 log2 |n| products for each end. */
[[nodiscard]] Interval pow(const Interval& x, int n);

/** {|t|}, exactly. */
[[nodiscard]] inline Interval abs(const Interval& x) {
  if (!x.IsFinite()) return Interval::Entire();
  return x.lower >= 0 ? x : x.upper <= 0 ? -x : Interval(0, x.Magnitude());
}

/** {min(s, t)} and {max(s, t)}, s in a, t in b, exactly. */
[[nodiscard]] inline Interval min(const Interval& a, const Interval& b) {
  if (!a.IsFinite() || !b.IsFinite()) return Interval::Entire();
  return {std::min(a.lower, b.lower), std::min(a.upper, b.upper)};
}
[[nodiscard]] inline Interval max(const Interval& a, const Interval& b) {
  if (!a.IsFinite() || !b.IsFinite()) return Interval::Entire();
  return {std::max(a.lower, b.lower), std::max(a.upper, b.upper)};
}

/** @name The derivatives of functions with kinks and cuts
    d|t| = sign(t) dt,                                    d sign(t) = d step(t) = kink(t) dt,
    d max(s, t) = step(s - t) ds + step(t - s) dt,        d min(s, t) = step(t - s) ds + step(s - t) dt,
    d atan2(t, s) = (s dt - t ds) / (s^2 + t^2) + cut(t, s).
At a kink the first derivative is the set of all slopes between those on both sides (Clarke's generalised gradient), and
the second has no bound. An interval that only touches a kink meets it. */
///@{
/** 1 for x > 0; 0 for x < 0; [0, 1] if x meets 0. */
[[nodiscard]] inline Interval step(const Interval& x) {
  if (!x.IsFinite()) return Interval::Entire();
  return {x.lower > 0 ? 1.0 : 0.0, x.upper < 0 ? 0.0 : 1.0};
}

/** 1 for x > 0; -1 for x < 0; [-1, 1] if x meets 0. */
[[nodiscard]] inline Interval sign(const Interval& x) {
  if (!x.IsFinite()) return Interval::Entire();
  return {x.lower > 0 ? 1.0 : -1.0, x.upper < 0 ? -1.0 : 1.0};
}

/** 0 if x does not contain 0; otherwise [-inf, inf]. */
[[nodiscard]] inline Interval kink(const Interval& x) {
  return x.IsFinite() && !x.Contains(0) ? Interval(0) : Interval::Entire();
}

/** 0 if no point (s, t), s in x, t in y, lies on {y = 0, x <= 0}; otherwise [-inf, inf]. */
[[nodiscard]] inline Interval cut(const Interval& y, const Interval& x) {
  const bool beside = x.lower > 0 || !y.Contains(0);
  return x.IsFinite() && y.IsFinite() && beside ? Interval(0) : Interval::Entire();
}
///@}

}  // namespace forereach
