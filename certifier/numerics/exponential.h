/** Enclosures of the ranges of exp, log1p and sqrt over intervals, rounded outward. */
#pragma once

#include "certifier/numerics/interval.h"

namespace forereach {

/** {e^x}. */
[[nodiscard]] Interval exp(const Interval& x);

/** {log(1 + x)} if all of x lies above -1; otherwise [-inf, inf]. */
[[nodiscard]] Interval log1p(const Interval& x);

/** {sqrt(t) : t in x, t >= 0}; [-inf, inf] if there is no such t. */
[[nodiscard]] Interval sqrt(const Interval& x);

}  // namespace forereach
