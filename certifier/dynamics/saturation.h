/** The two functions by which residuals set in (residuals.h), over intervals: value, first and second derivative.

Each is monotone between extrema that are known in closed form, so the ranges are the exact ones but for rounding. */
#pragma once

#include "certifier/numerics/interval.h"

namespace forereach {

struct DerivativeRanges {
  Interval value, first, second;
};

/** exp(-1/e) for e > 0, else 0. Where e <= 0 all three are exactly zero. */
[[nodiscard]] DerivativeRanges SmoothGateRanges(const Interval& e);

/** u = x / temperature against f = temperature log(1 + exp(u)), temperature > 0:
    f_x = p = 1 / (1 + exp(-u)),  f_t = log(1 + exp(u)) - u p,  (f_xx, f_xt, f_tt) = (1, -u, u^2) p (1 - p) /
temperature. f increases in both. */
struct SoftplusRanges {
  Interval value, by_x, by_temperature, by_xx, by_xt, by_tt;

  SoftplusRanges(const Interval& x, const Interval& temperature);
};

}  // namespace forereach
