#include "verifier/dual.h"

#include <algorithm>
#include <utility>

#include "verifier/ranges.h"

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

Dual Gate(const Dual& e) { return Chain(Gate(e.value), Varies(e) ? GateSlope(e.value) : 0.0, e); }
Dual GateSlope(const Dual& e) { return Chain(GateSlope(e.value), Varies(e) ? GateBend(e.value) : 0.0, e); }

Dual SoftRamp(const Dual& x, const Dual& t) {
  const Real u = x.value / t.value;
  return Chain(SoftRamp(x.value, t.value), Varies(x) ? Logistic(u) : 0.0, x, Varies(t) ? SoftRampByTemperature(u) : 0.0,
               t);
}
Dual SoftStep(const Dual& x, const Dual& t) {
  const Real u = x.value / t.value;
  const Real bend = Varies(x) || Varies(t) ? LogisticSlope(u) / t.value : 0.0;
  return Chain(Logistic(u), bend, x, -(u * bend), t);
}

}  // namespace forereach::verifier
