#include "forereach/dynamics/jet.h"

#include <algorithm>

#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/saturation.h"
#include "forereach/numerics/elementary.h"

namespace forereach {
namespace {

constexpr Interval kZero(0.0), kAnySign(-1.0, 1.0);

bool IsZero(const Interval& x) { return x == kZero; }

// What is zero over the whole box stays so whatever the other factor's bound: every value of that is a number. Values
// are multiplied without this rule, so that one which may be undefined shows in the result.
Interval Times(const Interval& a, const Interval& b) { return IsZero(a) || IsZero(b) ? kZero : a * b; }
Interval Plus(const Interval& a, const Interval& b) { return IsZero(a) ? b : IsZero(b) ? a : a + b; }
Interval Over(const Interval& a, const Interval& b) { return IsZero(a) ? kZero : a / b; }

// f(a) from the ranges of f and its derivatives over a. Where f may be undefined, the formulas of its derivatives may
// still have values.
Jet Composed(const Jet& a, DerivativeRanges f) {
  if (!f.value.IsFinite()) f.first = f.second = Interval::Entire();
  Jet result(f.value);
  result.size = a.size;
  result.slope = Times(f.first, a.slope);
  const Interval bend = Times(f.second, a.slope);
  for (std::size_t i = 0; i < ToSize(a.size); ++i) {
    result.gradient[i] = Times(f.first, a.gradient[i]);
    result.curvature[i] = Plus(Times(bend, a.gradient[i]), Times(f.first, a.curvature[i]));
  }
  return result;
}

// The ranges of a function f(a, b) and of its derivatives.
struct BinaryRanges {
  Interval value, by_a, by_b, by_aa, by_ab, by_bb;
};

Jet Composed(const Jet& a, const Jet& b, const BinaryRanges& f) {
  Jet result(f.value);
  result.size = std::max(a.size, b.size);
  result.slope = Plus(Times(f.by_a, a.slope), Times(f.by_b, b.slope));
  // d f_a and d f_b along the coordinate
  const Interval bend_a = Plus(Times(f.by_aa, a.slope), Times(f.by_ab, b.slope));
  const Interval bend_b = Plus(Times(f.by_ab, a.slope), Times(f.by_bb, b.slope));
  for (std::size_t i = 0; i < ToSize(result.size); ++i) {
    const Interval &da = a.gradient[i], &db = b.gradient[i];
    result.gradient[i] = Plus(Times(f.by_a, da), Times(f.by_b, db));
    result.curvature[i] = Plus(Plus(Times(bend_a, da), Times(bend_b, db)),
                               Plus(Times(f.by_a, a.curvature[i]), Times(f.by_b, b.curvature[i])));
  }
  return result;
}

// Either of two expressions at each point, as at the kink where they meet.
Jet Either(const Jet& a, const Jet& b, const Interval& value) {
  Jet result(value);
  result.size = std::max(a.size, b.size);
  result.slope = Join(a.slope, b.slope);
  for (std::size_t i = 0; i < ToSize(result.size); ++i) {
    result.gradient[i] = Join(a.gradient[i], b.gradient[i]);
    result.curvature[i] = Interval::Entire();
  }
  return result;
}

}  // namespace

Jet operator+(const Jet& a, const Jet& b) {
  Jet result(a.value + b.value);
  result.size = std::max(a.size, b.size);
  result.slope = Plus(a.slope, b.slope);
  for (std::size_t i = 0; i < ToSize(result.size); ++i) {
    result.gradient[i] = Plus(a.gradient[i], b.gradient[i]);
    result.curvature[i] = Plus(a.curvature[i], b.curvature[i]);
  }
  return result;
}

Jet operator-(const Jet& a) {
  Jet result(-a.value);
  result.size = a.size;
  result.slope = -a.slope;
  for (std::size_t i = 0; i < ToSize(a.size); ++i) {
    result.gradient[i] = -a.gradient[i];
    result.curvature[i] = -a.curvature[i];
  }
  return result;
}

Jet operator-(const Jet& a, const Jet& b) { return a + -b; }

Jet operator*(const Jet& a, const Jet& b) {
  if (&a == &b) return Composed(a, {sqr(a.value), Interval(2) * a.value, Interval(2)});
  Jet result(a.value * b.value);
  result.size = std::max(a.size, b.size);
  result.slope = Plus(Times(a.value, b.slope), Times(a.slope, b.value));
  for (std::size_t i = 0; i < ToSize(result.size); ++i) {
    result.gradient[i] = Plus(Times(a.value, b.gradient[i]), Times(a.gradient[i], b.value));
    result.curvature[i] = Plus(Plus(Times(a.value, b.curvature[i]), Times(a.curvature[i], b.value)),
                               Plus(Times(a.gradient[i], b.slope), Times(a.slope, b.gradient[i])));
  }
  return result;
}

// With q = a / b: dq = (da - q db) / b, and once more.
Jet operator/(const Jet& a, const Jet& b) {
  Jet q(a.value / b.value);
  q.size = std::max(a.size, b.size);
  q.slope = Over(Plus(a.slope, -Times(q.value, b.slope)), b.value);
  for (std::size_t i = 0; i < ToSize(q.size); ++i) {
    q.gradient[i] = Over(Plus(a.gradient[i], -Times(q.value, b.gradient[i])), b.value);
    const Interval rest =
        Plus(Plus(Times(q.gradient[i], b.slope), Times(q.slope, b.gradient[i])), Times(q.value, b.curvature[i]));
    q.curvature[i] = Over(Plus(a.curvature[i], -rest), b.value);
  }
  return q;
}

// A box that only touches the kink lies on one side of it.
Jet abs(const Jet& a) {
  if (a.value.lower >= 0 && a.value.upper > 0) return a;
  if (a.value.upper <= 0 && a.value.lower < 0) return -a;
  return Composed(a, {abs(a.value), kAnySign, Interval::Entire()});
}

Jet SignedSquare(const Jet& a) {
  return Composed(a, {SignedSquare(a.value), Interval(2) * abs(a.value), Interval(2) * sign(a.value)});
}

Jet max(const Jet& a, const Jet& b) {
  if (a.value.lower > b.value.upper) return a;
  if (b.value.lower > a.value.upper) return b;
  return Either(a, b, max(a.value, b.value));
}

Jet min(const Jet& a, const Jet& b) { return -max(-a, -b); }

Jet sqrt(const Jet& a) {
  const Interval root = sqrt(a.value), slope = Interval(0.5) / root;
  return Composed(a, {root, slope, -slope / (Interval(2) * a.value)});
}

Jet exp(const Jet& a) {
  const Interval value = exp(a.value);
  return Composed(a, {value, value, value});
}

Jet sin(const Jet& a) {
  const Interval value = sin(a.value);
  return Composed(a, {value, cos(a.value), -value});
}

Jet cos(const Jet& a) {
  const Interval value = cos(a.value);
  return Composed(a, {value, -sin(a.value), -value});
}

// Within a quarter turn the tangent has the sign of its argument. An enclosure that crosses zero would add a kink to
// the absolute value of this tangent.
Jet tan(const Jet& a) {
  Interval t = tan(a.value);
  if (t.IsFinite() && 0 <= a.value.lower && a.value.upper <= 1.5) t.lower = std::max(t.lower, 0.0);
  if (t.IsFinite() && -1.5 <= a.value.lower && a.value.upper <= 0) t.upper = std::min(t.upper, 0.0);
  const Interval slope = Interval(1) + sqr(t);
  return Composed(a, {t, slope, Interval(2) * t * slope});
}

Jet log(const Jet& a) {
  const Interval slope = Interval(1) / a.value;
  return Composed(a, {log(a.value), slope, -sqr(slope)});
}

Jet asin(const Jet& a) {
  const Interval slope = Interval(1) / sqrt(Interval(1) - sqr(a.value));
  return Composed(a, {asin(a.value), slope, a.value * slope * sqr(slope)});
}

Jet acos(const Jet& a) {
  const Interval slope = Interval(-1) / sqrt(Interval(1) - sqr(a.value));
  return Composed(a, {acos(a.value), slope, a.value * slope * sqr(slope)});
}

Jet atan(const Jet& a) {
  const Interval slope = Interval(1) / (Interval(1) + sqr(a.value));
  return Composed(a, {atan(a.value), slope, Interval(-2) * a.value * sqr(slope)});
}

Jet tanh(const Jet& a) {
  const Interval value = tanh(a.value), slope = Interval(1) - sqr(value);
  return Composed(a, {value, slope, Interval(-2) * value * slope});
}

Jet pow(const Jet& a, int n) {
  const auto derivative = [&](double factor, int exponent) {
    return factor == 0 ? kZero : Interval(factor) * pow(a.value, exponent);
  };
  const double order = n;
  return Composed(a, {pow(a.value, n), derivative(order, n - 1), derivative(order * (order - 1), n - 2)});
}

// With w = 1 / (s^2 + t^2), d atan2(t, s) = w (s dt - t ds), and once more with dw = -2 w^2 (s ds + t dt).
Jet atan2(const Jet& y, const Jet& x) {
  const Interval &t = y.value, &s = x.value;
  const Interval weight = cut(t, s) + Interval(1) / (sqr(s) + sqr(t)), square = sqr(weight);
  const Interval by_tt = Interval(-2) * s * t * square;
  return Composed(y, x, {atan2(t, s), s * weight, -t * weight, by_tt, (sqr(t) - sqr(s)) * square, -by_tt});
}

Jet SmoothGate(const Jet& a) { return Composed(a, SmoothGateRanges(a.value)); }

Jet Softplus(const Jet& x, const Jet& temperature) {
  const SoftplusRanges f(x.value, temperature.value);
  return Composed(x, temperature, {f.value, f.by_x, f.by_temperature, f.by_xx, f.by_xt, f.by_tt});
}

Jet step(const Jet& a) {
  const Interval jump = kink(a.value);
  return Composed(a, {step(a.value), jump, jump});
}

Jet sign(const Jet& a) {
  const Interval jump = kink(a.value);
  return Composed(a, {sign(a.value), jump, jump});
}

Jet kink(const Jet& a) {
  const Interval jump = kink(a.value);
  return Composed(a, {jump, jump, jump});
}

Jet cut(const Jet& y, const Jet& x) {
  const Interval jump = cut(y.value, x.value);
  return Composed(y, x, {jump, jump, jump, jump, jump, jump});
}

Jet TanCurvature(const Jet& t) {
  return Composed(t, {TanCurvature(t.value), Interval(2) + Interval(6) * sqr(t.value), Interval(12) * t.value});
}

}  // namespace forereach
