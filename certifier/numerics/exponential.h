/** Ranges of the functions around the exponential over intervals, rounded outward, as interval.h has them of the
trigonometric ones. */
#pragma once

#include "certifier/numerics/interval.h"

namespace forereach {

/** {e^x}. */
[[nodiscard]] Interval exp(const Interval& x);

/** {log(1 + x) : x > -1}; where x may reach -1 or below, [-inf, inf]. */
[[nodiscard]] Interval log1p(const Interval& x);

/** {sqrt(x) : x >= 0}; [-inf, inf] where there is no such x. */
[[nodiscard]] Interval sqrt(const Interval& x);

}  // namespace forereach
