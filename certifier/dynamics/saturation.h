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

/** log(1 + exp(x)). */
[[nodiscard]] DerivativeRanges SoftplusRanges(const Interval& x);

}  // namespace forereach
