/** One argument's share in the mean-value form of a function whose slopes are bounded over a box. */
#pragma once

#include <algorithm>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/interval.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

struct ExpansionPoint {
  double point;   ///< Where to expand.
  double excess;  ///< An upper bound on how much more than at `point` the function has anywhere in the range.
};

/** Expands an argument with a range and a slope around the point for which the upper bound is least: with slopes in
[-l, u] over a width w the excess is l u w / (l + u). @pre both are finite, and range.lower < range.upper. */
[[nodiscard]] inline ExpansionPoint ExpandForUpperBound(const Interval& range, const Interval& rise) {
  const double share = rise.upper / (rise.upper - rise.lower);
  const double best = range.lower + share * (range.upper - range.lower);
  const double point = range.Contains(best) ? best : range.Middle();  // the sum may overflow
  return {point, std::max(MulUp(rise.upper, SubUp(range.upper, point)), MulUp(-rise.lower, SubUp(point, range.lower)))};
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
