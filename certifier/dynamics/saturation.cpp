#include "certifier/dynamics/saturation.h"

#include <algorithm>
#include <initializer_list>

#include "certifier/numerics/exponential.h"

namespace forereach {
namespace {

Interval Hull(const Interval& a, const Interval& b) {
  return {std::min(a.lower, b.lower), std::max(a.upper, b.upper)};
}

// The range of a function over x: its values at the ends and at those of its extrema that x may meet.
template <class Function>
Interval RangeOf(const Function& at, const Interval& x, std::initializer_list<Interval> extrema) {
  Interval range = Hull(at(Interval(x.lower)), at(Interval(x.upper)));
  for (const Interval& e : extrema)
    if (e.lower <= x.upper && x.lower <= e.upper) range = Hull(range, at(e));
  return range;
}

// ---- exp(-1/e). Below kFirst all three increase, and are below 1e-400.
constexpr double kFirst = 0x1p-10;

// Extends a function that is good from kFirst on to all e.
template <class Function>
Interval FromZero(const Function& at, const Interval& e) {
  if (e.upper <= 0) return 0.0;
  if (e.lower >= kFirst) return at(e);
  return Hull(0.0, at(Interval(kFirst, std::max(kFirst, e.upper))));
}

Interval Gate(const Interval& e) {
  return FromZero([](const Interval& x) { return exp(Interval(-1) / x); }, e);
}
Interval GateFirst(const Interval& e) {
  return FromZero([](const Interval& x) { return exp(Interval(-1) / x) / sqr(x); }, e);
}
Interval GateSecond(const Interval& e) {
  const auto at = [](const Interval& x) {
    return exp(Interval(-1) / x) * (Interval(1) - Interval(2) * x) / sqr(sqr(x));
  };
  return FromZero(at, e);
}

// ---- log(1 + exp(x)): its derivative is p = 1 / (1 + exp(-x)), the next p (1 - p).

Interval SoftplusAt(const Interval& x) {
  return x.lower > 0 ? x + log1p(exp(-x)) : log1p(exp(x));
}
Interval Logistic(const Interval& x) {
  const Interval small = exp(x.lower > 0 ? -x : x);
  return (x.lower > 0 ? Interval(1) : small) / (Interval(1) + small);
}
Interval LogisticSlope(const Interval& x) {
  const Interval small = exp(x.lower > 0 ? -x : x);
  return small / sqr(Interval(1) + small);
}

}  // namespace

DerivativeRanges SmoothGateRanges(const Interval& e) {
  if (e.upper <= 0) return {0.0, 0.0, 0.0};
  if (!e.IsFinite()) return {{0, 1}, {0, 1}, {-1, 3}};
  // (e^(-1/e))''' = 0 where 1 - 6 e + 6 e^2 = 0.
  static const Interval kRoot = sqrt(Interval(3)), kBend = (Interval(3) - kRoot) / Interval(6),
                        kOtherBend = (Interval(3) + kRoot) / Interval(6);
  return {RangeOf(Gate, e, {}), RangeOf(GateFirst, e, {0.5}), RangeOf(GateSecond, e, {kBend, kOtherBend})};
}

DerivativeRanges SoftplusRanges(const Interval& x) {
  if (!x.IsFinite()) return {Interval::Entire(), {0, 1}, {0, 0.25}};
  return {RangeOf(SoftplusAt, x, {}), RangeOf(Logistic, x, {}), RangeOf(LogisticSlope, x, {0.0})};
}

}  // namespace forereach
