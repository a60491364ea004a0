// All three increase, so the values at the ends span a range. The C library's are within one unit in the last place of
// the exact value (glibc's manual, "Known Maximum Errors"); we widen by two, as elementary.cpp does.
#include "certifier/numerics/exponential.h"

#include <algorithm>
#include <cmath>

namespace forereach {
Interval exp(const Interval& x) { return {std::max(0.0, WidenDown(std::exp(x.lower))), WidenUp(std::exp(x.upper))}; }

Interval log1p(const Interval& x) {
  if (!(x.lower > -1)) return Interval::Entire();
  return {WidenDown(std::log1p(x.lower)), WidenUp(std::log1p(x.upper))};
}

Interval sqrt(const Interval& x) {
  if (!(x.upper >= 0)) return Interval::Entire();
  return {SqrtDown(std::max(x.lower, 0.0)), SqrtUp(x.upper)};
}

}  // namespace forereach
