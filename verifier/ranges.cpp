#include "verifier/ranges.h"

#include <initializer_list>

namespace forereach::verifier {
namespace {

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

// At points: log(1 + exp(u)), 1 / (1 + exp(-u)), its derivative, and log(1 + exp(u)) - u / (1 + exp(-u)).
Real LogAt(const Real& u) { return max(u, 0.0) + log1p(exp(-abs(u))); }
Real LogisticAt(const Real& u) { return Real(1.0) / (Real(1.0) + exp(-u)); }
Real LogisticSlopeAt(const Real& u) { return LogisticAt(u) * LogisticAt(-u); }
Real EntropyAt(const Real& u) { return LogAt(u) - u * LogisticAt(u); }

Real SignedSquareAt(const Real& a) { return a * abs(a); }

Real TangentBendAt(const Real& t) { return Real(2.0) * t * (Real(1.0) + sqr(t)); }

}  // namespace

Real Hull(const Real& a, const Real& b) { return Real::FromTo(min(a, b), max(a, b)); }

Real Gate(const Real& e) { return RangeOf(GateAt, e, {}); }
Real GateSlope(const Real& e) { return RangeOf(GateSlopeAt, e, {0.5}); }
// Its extrema are where 6 e^2 - 6 e + 1 = 0.
Real GateBend(const Real& e) {
  const Real root = sqrt(Real(3.0)), three(3.0), six(6.0);
  return RangeOf(GateBendAt, e, {(three - root) / six, (three + root) / six});
}

Real SoftRamp(const Real& x, const Real& t) {
  const auto at = [](const Real& x_end, const Real& t_end) { return t_end * LogAt(x_end / t_end); };
  return Hull(at(x.lower(), t.lower()), at(x.upper(), t.upper()));
}
Real Logistic(const Real& u) { return RangeOf(LogisticAt, u, {}); }
Real LogisticSlope(const Real& u) { return RangeOf(LogisticSlopeAt, u, {0.0}); }
Real SoftRampByTemperature(const Real& u) { return RangeOf(EntropyAt, u, {0.0}); }

Real SignedSquare(const Real& a) { return RangeOf(SignedSquareAt, a, {}); }
Real Sign(const Real& a) {
  const Real one(1.0), less(-1.0);
  return CertainlyBelow(0.0, a) ? one : CertainlyBelow(a, 0.0) ? less : Hull(less, one);
}

Real TangentBend(const Real& t) { return RangeOf(TangentBendAt, t, {}); }

}  // namespace forereach::verifier
