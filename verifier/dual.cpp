#include "verifier/dual.h"

#include <algorithm>
#include <initializer_list>
#include <utility>

namespace forereach::verifier {
namespace {

const Real& Entry(const Dual& a, std::size_t i) {
  static const Real zero(0.0);
  return i < a.gradient.size() ? a.gradient[i] : zero;
}

// value, with the gradient by_a grad a + by_b grad b.
Dual Chain(Real value, const Real& by_a, const Dual& a, const Real& by_b, const Dual& b) {
  Dual result(std::move(value));
  result.gradient.resize(std::max(a.gradient.size(), b.gradient.size()));
  for (std::size_t i = 0; i < result.gradient.size(); ++i) {
    if (!Entry(a, i).IsZero()) result.gradient[i] += by_a * Entry(a, i);
    if (!Entry(b, i).IsZero()) result.gradient[i] += by_b * Entry(b, i);
  }
  return result;
}

Dual Chain(Real value, const Real& slope, const Dual& a) {
  static const Dual none;
  return Chain(std::move(value), slope, a, Real(0.0), none);
}

// Derivatives cost as much as values, so they are computed only if the gradient is used.
bool Varies(const Dual& a) { return !a.gradient.empty(); }

Real Hull(const Real& a, const Real& b) { return Real::FromTo(min(a, b), max(a, b)); }

bool MayMeet(const Real& x, const Real& point) { return !CertainlyBelow(x, point) && !CertainlyBelow(point, x); }

// The range of a function that is monotone but for extrema.
template <class Function>
Real RangeOf(const Function& at, const Real& x, std::initializer_list<Real> extrema) {
  if (CertainlyAtMost(x.upper(), x.lower())) return at(x);
  Real range = Hull(at(x.lower()), at(x.upper()));
  for (const Real& extremum : extrema)
    if (MayMeet(x, extremum)) range = Hull(range, at(extremum));
  return range;
}

// At points: exp(-1/e), exp(-1/e) / e^2, exp(-1/e) (1 - 2 e) / e^4.
bool IsOff(const Real& e) { return CertainlyAtMost(e, 0.0); }
Real GateAt(const Real& e) { return IsOff(e) ? Real(0.0) : exp(Real(-1.0) / e); }
Real GateSlopeAt(const Real& e) { return IsOff(e) ? Real(0.0) : GateAt(e) / sqr(e); }
Real GateBendAt(const Real& e) { return IsOff(e) ? Real(0.0) : GateAt(e) * (Real(1.0) - Real(2.0) * e) / sqr(sqr(e)); }

Real GateSlopeRange(const Real& e) { return RangeOf(GateSlopeAt, e, {0.5}); }

// The bend's own extrema are where 6 e^2 - 6 e + 1 = 0.
Real GateBendRange(const Real& e) {
  const Real root = sqrt(Real(3.0)), three(3.0), six(6.0);
  return RangeOf(GateBendAt, e, {(three - root) / six, (three + root) / six});
}

// At points: log(1 + exp(u)), 1 / (1 + exp(-u)), its derivative, and log(1 + exp(u)) - u / (1 + exp(-u)).
Real LogAt(const Real& u) { return max(u, 0.0) + log1p(exp(-abs(u))); }
Real LogisticAt(const Real& u) { return Real(1.0) / (Real(1.0) + exp(-u)); }
Real LogisticSlopeAt(const Real& u) { return LogisticAt(u) * LogisticAt(-u); }
Real EntropyAt(const Real& u) { return LogAt(u) - u * LogisticAt(u); }

}  // namespace

Dual Dual::Variable(const Real& range, std::size_t place) {
  Dual variable(range);
  variable.gradient.resize(place + 1);
  variable.gradient[place] = Real(1.0);
  return variable;
}

Dual operator+(const Dual& a, const Dual& b) { return Chain(a.value + b.value, 1.0, a, 1.0, b); }
Dual operator-(const Dual& a, const Dual& b) { return Chain(a.value - b.value, 1.0, a, -1.0, b); }
Dual operator*(const Dual& a, const Dual& b) { return Chain(a.value * b.value, b.value, a, a.value, b); }
Dual operator/(const Dual& a, const Dual& b) {
  const Real quotient = a.value / b.value, inverse = Real(1.0) / b.value;
  return Chain(quotient, inverse, a, -(quotient * inverse), b);
}
Dual sqr(const Dual& a) { return Chain(sqr(a.value), Real(2.0) * a.value, a); }
Dual sqrt(const Dual& a) {
  const Real root = sqrt(a.value);
  return Chain(root, Real(0.5) / root, a);
}
Dual abs(const Dual& a) {
  if (CertainlyBelow(0.0, a.value)) return a;
  if (CertainlyBelow(a.value, 0.0)) return Dual(0.0) - a;
  const bool positive = CertainlyAtMost(0.0, a.value), negative = CertainlyAtMost(a.value, 0.0);
  const Real sign = Real::FromTo(positive && !negative ? 1.0 : -1.0, negative && !positive ? -1.0 : 1.0);
  return Chain(abs(a.value), sign, a);
}
Dual tan(const Dual& a) {
  const Real t = tan(a.value);
  return Chain(t, Real(1.0) + sqr(t), a);
}

Dual Gate(const Dual& e) { return Chain(RangeOf(GateAt, e.value, {}), Varies(e) ? GateSlopeRange(e.value) : 0.0, e); }
Dual GateSlope(const Dual& e) { return Chain(GateSlopeRange(e.value), Varies(e) ? GateBendRange(e.value) : 0.0, e); }

Dual SoftRamp(const Dual& x, const Dual& t) {
  const auto at = [](const Real& x_end, const Real& t_end) { return t_end * LogAt(x_end / t_end); };
  const Real value = Hull(at(x.value.lower(), t.value.lower()), at(x.value.upper(), t.value.upper()));
  const Real u = x.value / t.value;
  return Chain(value, Varies(x) ? RangeOf(LogisticAt, u, {}) : 0.0, x, Varies(t) ? RangeOf(EntropyAt, u, {0.0}) : 0.0,
               t);
}
Dual SoftStep(const Dual& x, const Dual& t) {
  const Real u = x.value / t.value;
  const Real bend = Varies(x) || Varies(t) ? RangeOf(LogisticSlopeAt, u, {0.0}) / t.value : 0.0;
  return Chain(RangeOf(LogisticAt, u, {}), bend, x, -(u * bend), t);
}

}  // namespace forereach::verifier
