/** Ranges of the functions SmoothGate and Softplus (residuals.h) and of their first and second derivatives over
intervals.

Each function is monotone between extrema with a closed form, so the ranges are exact up to outward rounding. */
#pragma once

#include "certifier/numerics/interval.h"

namespace forereach {

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

}  // namespace forereach
