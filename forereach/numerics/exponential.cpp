// exp, log, log1p, sqrt and tanh increase, so the values at the ends span a range. The C library's are within one unit
// in the last place of the exact value (glibc's manual, "Known Maximum Errors"), those of tanh within three; we widen
// by two and by eight doubles. Powers are products, each rounded to the safe side.
#include <algorithm>
#include <cmath>

#include "forereach/numerics/elementary.h"

namespace forereach {
namespace {

// Just below a power of two, eight doubles are four units in the last place of a value above it.
double WidenByEightUp(double x) { return WidenUp(WidenUp(WidenUp(WidenUp(x)))); }
double WidenByEightDown(double x) { return -WidenByEightUp(-x); }

// a^n for a >= 0, by squaring. Every factor is non-negative, so bounds of the factors give a bound of the product.
template <double (*kMultiply)(double, double) noexcept>
double Power(double a, unsigned n) {
  double power = 1;
  while (true) {
    if (n % 2 == 1) power = std::max(0.0, kMultiply(power, a));
    n /= 2;
    if (n == 0) return power;
    a = std::max(0.0, kMultiply(a, a));
  }
}

// a^n for odd n.
double OddPowerDown(double a, unsigned n) { return a >= 0 ? Power<MulDown>(a, n) : -Power<MulUp>(-a, n); }
double OddPowerUp(double a, unsigned n) { return -OddPowerDown(-a, n); }

Interval Power(const Interval& x, unsigned n) {
  if (n % 2 == 1) return {OddPowerDown(x.lower, n), OddPowerUp(x.upper, n)};
  const double near = x.Contains(0) ? 0 : std::min(std::abs(x.lower), std::abs(x.upper));
  return {Power<MulDown>(near, n), Power<MulUp>(x.Magnitude(), n)};
}

}  // namespace

Interval exp(const Interval& x) {
  if (!x.IsFinite()) return Interval::Entire();
  return {std::max(0.0, WidenDown(std::exp(x.lower))), WidenUp(std::exp(x.upper))};
}

// The logarithm of 1 is exactly 0, and the sign on both sides is known.
Interval log(const Interval& x) {
  if (!(x.lower > 0) || !x.IsFinite()) return Interval::Entire();
  const double lower = WidenDown(std::log(x.lower)), upper = WidenUp(std::log(x.upper));
  return {x.lower >= 1 ? std::max(lower, 0.0) : lower, x.upper <= 1 ? std::min(upper, 0.0) : upper};
}

Interval log1p(const Interval& x) {
  if (!(x.lower > -1) || !x.IsFinite()) return Interval::Entire();
  return {WidenDown(std::log1p(x.lower)), WidenUp(std::log1p(x.upper))};
}

Interval sqrt(const Interval& x) {
  if (!(x.lower >= 0) || !x.IsFinite()) return Interval::Entire();
  return {SqrtDown(x.lower), SqrtUp(x.upper)};
}

Interval tanh(const Interval& x) {
  if (!x.IsFinite()) return Interval::Entire();
  const double lower = WidenByEightDown(std::tanh(x.lower)), upper = WidenByEightUp(std::tanh(x.upper));
  return {std::max(lower, x.lower >= 0 ? 0.0 : -1.0), std::min(upper, x.upper <= 0 ? 0.0 : 1.0)};
}

Interval pow(const Interval& x, int n) {
  const Interval base = n < 0 ? Interval(1) / x : x;
  if (!base.IsFinite()) return Interval::Entire();
  return Power(base, n < 0 ? 0U - static_cast<unsigned>(n) : static_cast<unsigned>(n));
}

}  // namespace forereach
