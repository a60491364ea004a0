/** The functions SignedSquare, SmoothGate and Softplus, and the ranges of them and of their first and second
derivatives over intervals.

Each function is monotone between extrema with a closed form, so the ranges are exact up to outward rounding. */
#pragma once

#include <cmath>

#include "forereach/numerics/interval.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

/** t |t|: increasing, with the derivative 2 |t|, which is Lipschitz with the constant 2. */
template <class T>
T SignedSquare(const T& t) {
  using std::abs;
  return t * abs(t);
}
inline Interval SignedSquare(const Interval& x) {
  if (!x.IsFinite()) return Interval::Entire();
  return {x.lower < 0 ? -MulUp(x.lower, x.lower) : MulDown(x.lower, x.lower),
          x.upper < 0 ? -MulDown(x.upper, x.upper) : MulUp(x.upper, x.upper)};
}

/** exp(-1/e) for e > 0, and 0 for e <= 0. All derivatives vanish at 0. */
template <class T>
T SmoothGate(const T& e) {
  using std::exp;
  return e > T(0) ? exp(T(-1) / e) : T(0);
}

/** temperature log(1 + exp(x / temperature)), a smooth max(x, 0), without overflow. temperature > 0. */
template <class T>
T Softplus(const T& x, const T& temperature) {
  using std::exp, std::log1p;
  const T u = x / temperature;
  return temperature * (u > T(0) ? u + log1p(exp(-u)) : log1p(exp(u)));
}

struct DerivativeRanges {
  Interval value, first, second;
};

/** SmoothGate: exp(-1/e) for e > 0, and 0 for e <= 0, where all three are exactly zero. */
[[nodiscard]] DerivativeRanges SmoothGateRanges(const Interval& e);

/** Softplus: f = temperature log(1 + exp(u)) with u = x / temperature and temperature > 0. Its derivatives are
    f_x = p = 1 / (1 + exp(-u)),  f_t = log(1 + exp(u)) - u p,  (f_xx, f_xt, f_tt) = (1, -u, u^2) p (1 - p) /
temperature. f increases in both. */
struct SoftplusRanges {
  Interval value, by_x, by_temperature, by_xx, by_xt, by_tt;

  SoftplusRanges(const Interval& x, const Interval& temperature);
};

inline Interval SmoothGate(const Interval& e) { return SmoothGateRanges(e).value; }
inline Interval Softplus(const Interval& x, const Interval& temperature) {
  return SoftplusRanges(x, temperature).value;
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
