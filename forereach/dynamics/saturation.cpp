#include "forereach/dynamics/saturation.h"

#include <algorithm>
#include <initializer_list>

#include "forereach/numerics/elementary.h"

namespace forereach {
namespace {

// The range of a function over x: its values at the ends and at those of its extrema that x may meet.
template <class Function>
Interval RangeOf(const Function& at, const Interval& x, std::initializer_list<Interval> extrema) {
  Interval range = Join(at(Interval(x.lower)), at(Interval(x.upper)));
  for (const Interval& e : extrema)
    if (e.lower <= x.upper && x.lower <= e.upper) range = Join(range, at(e));
  return range;
}

// ---- exp(-1/e). Below kFirst all three increase, and are below 1e-400.
constexpr double kFirst = 0x1p-10;

// Extends a function that is good from kFirst on to all e.
template <class Function>
Interval FromZero(const Function& at, const Interval& e) {
  if (e.upper <= 0) return 0.0;
  if (e.lower >= kFirst) return at(e);
  return Join(0.0, at(Interval(kFirst, std::max(kFirst, e.upper))));
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

// ---- t log(1 + exp(x / t)), at points.

Interval LogOnePlusExp(const Interval& u) { return u.lower > 0 ? u + log1p(exp(-u)) : log1p(exp(u)); }
Interval Logistic(const Interval& u) {
  const Interval small = exp(u.lower > 0 ? -u : u);
  return (u.lower > 0 ? Interval(1) : small) / (Interval(1) + small);
}
Interval LogisticSlope(const Interval& u) {
  const Interval small = exp(u.lower > 0 ? -u : u);
  return small / sqr(Interval(1) + small);
}
// log(1 + exp(u)) - u p: even, falls with |u|, never negative.
Interval Entropy(const Interval& u) {
  const Interval positive = u.lower > 0 ? u : -u, small = exp(-positive);
  const Interval entropy = log1p(small) + positive * small / (Interval(1) + small);
  return {std::max(0.0, entropy.lower), entropy.upper};
}

}  // namespace

DerivativeRanges SmoothGateRanges(const Interval& e) {
  if (!e.IsFinite()) return {Interval::Entire(), Interval::Entire(), Interval::Entire()};
  if (e.upper <= 0) return {0.0, 0.0, 0.0};
  // (e^(-1/e))''' = 0 where 1 - 6 e + 6 e^2 = 0.
  static const Interval kRoot = sqrt(Interval(3)), kBend = (Interval(3) - kRoot) / Interval(6),
                        kOtherBend = (Interval(3) + kRoot) / Interval(6);
  return {RangeOf(Gate, e, {}), RangeOf(GateFirst, e, {0.5}), RangeOf(GateSecond, e, {kBend, kOtherBend})};
}

SoftplusRanges::SoftplusRanges(const Interval& x, const Interval& temperature)
    : value(Interval::Entire()), by_x(0, 1), by_temperature(0, 1), by_xx(value), by_xt(value), by_tt(value) {
  const Interval u = x / temperature;
  if (!u.IsFinite() || !(temperature.lower > 0)) return;
  const auto at = [](double x_end, double t_end) {
    const Interval t(t_end);
    return t * LogOnePlusExp(Interval(x_end) / t);
  };
  value = {at(x.lower, temperature.lower).lower, at(x.upper, temperature.upper).upper};
  by_x = RangeOf(Logistic, u, {});
  by_temperature = RangeOf(Entropy, u, {0.0});
  by_xx = RangeOf(LogisticSlope, u, {0.0}) / temperature;
  by_xt = -(u * by_xx);
  by_tt = sqr(u) * by_xx;
}

}  // namespace forereach
