/** The expansion of a nominal model around a point: value f0(c), Jacobian D f0(c), and the range of each second
derivative over a box.

All arithmetic is plain, rounded to nearest, so no number here is a bound by itself; rounding.h bounds the error of
each. The code is straight-line code for a program that is known at compile time (program.h). */
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "forereach/dynamics/expansion.h"
#include "forereach/dynamics/saturation.h"
#include "forereach/numerics/elementary.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach::internal {

inline PlainInterval operator+(PlainInterval a, PlainInterval b) { return {a.lower + b.lower, a.upper + b.upper}; }
inline PlainInterval operator-(PlainInterval a) { return {-a.upper, -a.lower}; }
inline PlainInterval operator-(PlainInterval a, PlainInterval b) { return {a.lower - b.upper, a.upper - b.lower}; }
inline PlainInterval Scaled(double a, PlainInterval b) {
  const double p = a * b.lower, q = a * b.upper;
  return {std::min(p, q), std::max(p, q)};
}
inline PlainInterval operator*(PlainInterval a, PlainInterval b) {
  const double p = a.lower * b.lower, q = a.lower * b.upper, r = a.upper * b.lower, s = a.upper * b.upper;
  return {std::min(std::min(p, q), std::min(r, s)), std::max(std::max(p, q), std::max(r, s))};
}
inline PlainInterval Divide(PlainInterval a, PlainInterval b) {
  return a * PlainInterval{1 / b.upper, 1 / b.lower};
}  // b does not contain 0
inline PlainInterval Square(PlainInterval a) {
  const double p = a.lower * a.lower, q = a.upper * a.upper;
  const bool has_zero = a.lower <= 0 && a.upper >= 0;
  return {has_zero ? 0 : std::min(p, q), std::max(p, q)};
}
inline PlainInterval TanCurvature(PlainInterval t) {
  return {2 * t.lower * (1 + t.lower * t.lower), 2 * t.upper * (1 + t.upper * t.upper)};
}

/** A number for each end of an interval. */
using Ends [[gnu::vector_size(16)]] = double;

FOREREACH_INLINE Ends Both(double x) { return Ends{x, x}; }

/** The angles from a center c to the ends of an interval around it: their sines (the first is negative) and cosines. Up
to an angle of 1/4 by Taylor's polynomials, whose first omitted term is below 2^-52; above by the C library. */
struct Turns {
  Ends sine, cosine;
  bool wide;  // above 3: the slopes at the ends do not show whether a sine is monotone on the interval

  FOREREACH_INLINE Turns(double center, PlainInterval x) : wide(!(x.upper - x.lower <= 3)) {
    const Ends angle{center - x.lower, x.upper - center}, s = angle * angle;
    const Ends size =
        angle - angle * s * (1. / 6 - s * (1. / 120 - s * (1. / 5040 - s * (1. / 362880 - s * (1. / 39916800)))));
    sine = Ends{-size[0], size[1]};
    cosine = 1 - s * (1. / 2 - s * (1. / 24 - s * (1. / 720 - s * (1. / 40320 - s * (1. / 3628800)))));
    if (!(angle[0] <= 0.25)) sine[0] = -std::sin(angle[0]), cosine[0] = std::cos(angle[0]);
    if (!(angle[1] <= 0.25)) sine[1] = std::sin(angle[1]), cosine[1] = std::cos(angle[1]);
  }
};

/** Sine and cosine at both ends by the addition theorems. An extremum may lie inside if the slope changes its sign. */
struct Wave {
  Ends sines, cosines;
  bool wide;

  FOREREACH_INLINE Wave(double sine, double cosine, const Turns& turns)
      : sines(Both(sine) * turns.cosine + Both(cosine) * turns.sine),
        cosines(Both(cosine) * turns.cosine - Both(sine) * turns.sine),
        wide(turns.wide) {}

  [[nodiscard]] FOREREACH_INLINE PlainInterval SineRange() const { return Spanned(sines, cosines); }
  [[nodiscard]] FOREREACH_INLINE PlainInterval CosineRange() const { return Spanned(cosines, -sines); }

 private:
  [[nodiscard]] FOREREACH_INLINE PlainInterval Spanned(const Ends& ends, const Ends& slopes) const {
    return {wide || (slopes[0] <= 0 && slopes[1] >= 0) ? -1 : std::min(ends[0], ends[1]),
            wide || (slopes[0] >= 0 && slopes[1] <= 0) ? 1 : std::max(ends[0], ends[1])};
  }
};

/** The range of the tangent over an interval without a pole, given the tangent of its center. */
FOREREACH_INLINE PlainInterval TanRange(double tangent, const Turns& turns) {
  const Ends step = turns.sine / turns.cosine, range = (Both(tangent) + step) / (1 - Both(tangent) * step);
  return {range[0], range[1]};
}

/** The functions below are for any node, or with an operation as kOp for the nodes that have it: a compiler then drops
the other cases before it inlines them into the straight-line code of a program. */
inline constexpr Op kAnyOp{0xff};

/** The value of an operation on numbers; not that of a variable, a parameter or a constant. */
template <Op kOp>
FOREREACH_INLINE double ValueOf(const Operation& n, double a, double b) {
  switch (kOp == kAnyOp ? n.op : kOp) {
    case Op::kVariable:
    case Op::kParameter: break;
    case Op::kConstant: return n.constant;
    case Op::kAdd: return a + b;
    case Op::kSubtract: return a - b;
    case Op::kMultiply: return a * b;
    case Op::kDivide: return a / b;
    case Op::kNegate: return -a;
    case Op::kSquare: return a * a;
    case Op::kSin: return std::sin(a);
    case Op::kCos: return std::cos(a);
    case Op::kTan: return std::tan(a);
    case Op::kTanCurvature: return 2 * a * (1 + a * a);
    case Op::kPower: return std::pow(a, n.b);
    case Op::kSqrt: return std::sqrt(a);
    case Op::kExp: return std::exp(a);
    case Op::kLog: return std::log(a);
    case Op::kAsin: return std::asin(a);
    case Op::kAcos: return std::acos(a);
    case Op::kAtan: return std::atan(a);
    case Op::kAtan2: return std::atan2(a, b);
    case Op::kTanh: return std::tanh(a);
    case Op::kAbs: return std::abs(a);
    case Op::kSignedSquare: return a * std::abs(a);
    case Op::kMin: return std::min(a, b);
    case Op::kMax: return std::max(a, b);
    case Op::kSign:
    case Op::kSlopeOfAbs: return a > 0 ? 1 : a < 0 ? -1 : 0;
    case Op::kStep: return a > 0 ? 1 : 0;
    case Op::kKink:
    case Op::kCut: return 0;
    case Op::kSoftplus: return Softplus(a, b);
    case Op::kSmoothGate: return SmoothGate(a);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

FOREREACH_INLINE PlainInterval Plain(const Interval& x) { return {x.lower, x.upper}; }

/** The range of an operation over ranges, by plain arithmetic where that is quick; not that of a variable, a parameter,
a sine, a cosine or a tangent. */
template <Op kOp>
FOREREACH_INLINE PlainInterval RangeOf(const Operation& n, const PlainInterval& a, const PlainInterval& b,
                                       bool a_is_number, bool b_is_number) {
  const auto exact = [](const PlainInterval& x) __attribute__((always_inline)) { return Interval(x.lower, x.upper); };
  switch (kOp == kAnyOp ? n.op : kOp) {
    case Op::kConstant: return {n.constant, n.constant};
    case Op::kAdd: return a + b;
    case Op::kSubtract: return a - b;
    case Op::kMultiply:
      if (a_is_number) return Scaled(a.lower, b);
      if (b_is_number) return Scaled(b.lower, a);
      return a * b;
    case Op::kDivide: return Divide(a, b);
    case Op::kNegate: return -a;
    case Op::kSquare: return Square(a);
    case Op::kTanCurvature: return TanCurvature(a);
    case Op::kPower: return Plain(pow(exact(a), n.b));
    case Op::kSqrt: return Plain(sqrt(exact(a)));
    case Op::kExp: return Plain(exp(exact(a)));
    case Op::kLog: return Plain(log(exact(a)));
    case Op::kAsin: return Plain(asin(exact(a)));
    case Op::kAcos: return Plain(acos(exact(a)));
    case Op::kAtan: return Plain(atan(exact(a)));
    case Op::kAtan2: return Plain(atan2(exact(a), exact(b)));
    case Op::kTanh: return Plain(tanh(exact(a)));
    case Op::kAbs: return Plain(abs(exact(a)));
    case Op::kSignedSquare: return {a.lower * std::abs(a.lower), a.upper * std::abs(a.upper)};
    case Op::kSlopeOfAbs: return {a.lower > kNearZero ? 1.0 : -1.0, a.upper < -kNearZero ? -1.0 : 1.0};
    case Op::kMin: return Plain(min(exact(a), exact(b)));
    case Op::kMax: return Plain(max(exact(a), exact(b)));
    case Op::kSign: return Plain(sign(exact(a)));
    case Op::kStep: return Plain(step(exact(a)));
    case Op::kKink: return Plain(kink(exact(a)));
    case Op::kCut: return Plain(cut(exact(a), exact(b)));
    case Op::kSoftplus: return Plain(Softplus(exact(a), exact(b)));
    case Op::kSmoothGate: return Plain(SmoothGate(exact(a)));
    case Op::kVariable:
    case Op::kParameter:
    case Op::kSin:
    case Op::kCos:
    case Op::kTan: break;
  }
  return Plain(Interval::Entire());
}

/** Sets v[i], the value of node i at a point. */
template <Op kOp = kAnyOp>
FOREREACH_INLINE void EvaluateAtPoint(const Operation& n, std::size_t i, const double* parameters, const double* z,
                                      double* v) {
  switch (kOp == kAnyOp ? n.op : kOp) {
    case Op::kVariable: v[i] = z[n.a]; break;
    case Op::kParameter: v[i] = parameters[n.a]; break;
    case Op::kTan: v[i] = v[n.b] / v[n.b + 1]; break;  // sine over cosine
    default: v[i] = ValueOf<kOp>(n, n.has_first() ? v[n.a] : 0, n.has_second() ? v[n.b] : 0);
  }
}

/** Whether the node is the same number over the whole box. */
constexpr bool IsNumber(const Program& program, int i) {
  return i >= 0 && (program.node(i).op == Op::kParameter || program.node(i).op == Op::kConstant);
}

/** Sets w[i], the range of node i over a box; v has the values at its center. Sine and cosine of one argument share
their ends: the first of them that is needed sets both. */
template <Op kOp = kAnyOp>
FOREREACH_INLINE void EvaluateOverBox(const Program& program, std::size_t i, const double* parameters,
                                      const PlainInterval* box, const double* v, PlainInterval* w) {
  const Operation n = program.nodes[i];
  switch (kOp == kAnyOp ? n.op : kOp) {
    case Op::kVariable: w[i] = box[n.a]; break;
    case Op::kParameter: w[i] = {parameters[n.a], parameters[n.a]}; break;
    case Op::kSin: {
      const Wave wave(v[i], v[i + 1], Turns(v[n.a], w[n.a]));
      w[i] = wave.SineRange();
      w[i + 1] = wave.CosineRange();
      break;
    }
    case Op::kCos:
      if (program.over_box[ToSize(n.b)] == 0) w[i] = Wave(v[i - 1], v[i], Turns(v[n.a], w[n.a])).CosineRange();
      break;
    case Op::kTan: w[i] = TanRange(v[i], Turns(v[n.a], w[n.a])); break;
    default: {
      const PlainInterval none{0, 0};
      w[i] = RangeOf<kOp>(n, n.has_first() ? w[n.a] : none, n.has_second() ? w[n.b] : none, IsNumber(program, n.a),
                          n.has_second() && IsNumber(program, n.b));
    }
  }
}

/** Calls visit(0), ..., visit(N - 1) with constants, so that arrays indexed by them can live in registers. */
template <std::size_t N, class Visit>
FOREREACH_INLINE void ForEachConstant(Visit visit) {
  [&]<std::size_t... I>(std::index_sequence<I...>) __attribute__((always_inline)) {
    (visit(std::integral_constant<std::size_t, I>()), ...);
  }
  (std::make_index_sequence<N>());
}

/** NominalModel::Expand for one program, with a pointer for each span. Cost: the program's operations; no branch except
for angles above 1/4. If the domain contains a pole, the ranges mean nothing, and the bounds of rounding.h are
infinite. */
template <const Program& kProgram>
FOREREACH_INLINE void Expand(const double* parameters, const double* z, const PlainInterval* box, Expansion& out) {
  constexpr auto kSize = ToSize(kProgram.size);
  std::array<double, kSize> v;
  std::array<PlainInterval, kSize> w;
  ForEachConstant<kSize>([&](auto i) __attribute__((always_inline)) {
    constexpr Operation n = kProgram.nodes[i];
    if constexpr (kProgram.at_point[i] != 0) EvaluateAtPoint<n.op>(n, i, parameters, z, v.data());
  });
  ForEachConstant<kSize>([&](auto i) __attribute__((always_inline)) {
    if constexpr (kProgram.over_box[i] != 0)
      EvaluateOverBox<kProgram.nodes[i].op>(kProgram, i, parameters, box, v.data(), w.data());
  });
  ForEachConstant<kProgram.states>([&](auto k) __attribute__((always_inline)) { out.value[k] = v[kProgram.value[k]]; });
  ForEachConstant<kProgram.num_first>([&](auto e) __attribute__((always_inline)) {
    out.jacobian[e] = v[kProgram.jacobian[e].node];
  });
  ForEachConstant<kProgram.num_second>([&](auto e) __attribute__((always_inline)) {
    out.hessian[e] = w[kProgram.hessian[e].node];
  });
}

}  // namespace forereach::internal

FOREREACH_ARITHMETIC_END
