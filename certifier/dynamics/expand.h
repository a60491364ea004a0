/** The expansion of a nominal model around a point: value f0(c), Jacobian D f0(c), and the range of each second
derivative over a box.

All arithmetic is plain, rounded to nearest, so no number here is a bound by itself; rounding.h bounds the error of
each. The code is straight-line code for a program that is known at compile time (program.h). */
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "certifier/dynamics/expansion.h"
#include "certifier/numerics/instruction_set.h"
#include "certifier/numerics/lanes.h"
#include "certifier/numerics/size.h"

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

template <const Program& kProgram, std::size_t I>
inline void EvaluateAtPoint(const double* parameters, const double* z, double* v) {
  if constexpr (kProgram.at_point[I]) {
    constexpr Operation n = kProgram.nodes[I];
    if constexpr (n.op == Op::kVariable) v[I] = z[n.a];
    if constexpr (n.op == Op::kParameter) v[I] = parameters[n.a];
    if constexpr (n.op == Op::kConstant) v[I] = n.constant;
    if constexpr (n.op == Op::kAdd) v[I] = v[n.a] + v[n.b];
    if constexpr (n.op == Op::kSubtract) v[I] = v[n.a] - v[n.b];
    if constexpr (n.op == Op::kMultiply) v[I] = v[n.a] * v[n.b];
    if constexpr (n.op == Op::kDivide) v[I] = v[n.a] / v[n.b];
    if constexpr (n.op == Op::kNegate) v[I] = -v[n.a];
    if constexpr (n.op == Op::kSquare) v[I] = v[n.a] * v[n.a];
    if constexpr (n.op == Op::kSin) v[I] = std::sin(v[n.a]);
    if constexpr (n.op == Op::kCos) v[I] = std::cos(v[n.a]);
    if constexpr (n.op == Op::kTan) v[I] = v[n.b] / v[n.b + 1];
    static_assert(n.op != Op::kTanCurvature, "a second derivative in the Jacobian");
  }
}

/** Whether the node is the same number over the whole box. */
template <const Program& kProgram>
constexpr bool IsNumber(int i) {
  return kProgram.node(i).op == Op::kParameter || kProgram.node(i).op == Op::kConstant;
}

template <const Program& kProgram, std::size_t I>
inline void EvaluateOverBox(const double* parameters, const PlainInterval* box, const double* v, PlainInterval* w) {
  constexpr Operation n = kProgram.nodes[I];
  // Sine and cosine of one argument share their ends: the first of them that is needed sets both.
  constexpr bool kSecondOfPair = n.op == Op::kCos && kProgram.over_box[ToSize(n.b < 0 ? 0 : n.b)];
  if constexpr (kProgram.over_box[I] && !kSecondOfPair) {
    if constexpr (n.op == Op::kVariable) w[I] = box[n.a];
    if constexpr (n.op == Op::kParameter) w[I] = {parameters[n.a], parameters[n.a]};
    if constexpr (n.op == Op::kConstant) w[I] = {n.constant, n.constant};
    if constexpr (n.op == Op::kAdd) w[I] = w[n.a] + w[n.b];
    if constexpr (n.op == Op::kSubtract) w[I] = w[n.a] - w[n.b];
    if constexpr (n.op == Op::kMultiply) {
      if constexpr (IsNumber<kProgram>(n.a))
        w[I] = Scaled(w[n.a].lower, w[n.b]);
      else if constexpr (IsNumber<kProgram>(n.b))
        w[I] = Scaled(w[n.b].lower, w[n.a]);
      else
        w[I] = w[n.a] * w[n.b];
    }
    if constexpr (n.op == Op::kDivide) w[I] = Divide(w[n.a], w[n.b]);
    if constexpr (n.op == Op::kNegate) w[I] = -w[n.a];
    if constexpr (n.op == Op::kSquare) w[I] = Square(w[n.a]);
    if constexpr (n.op == Op::kTanCurvature) w[I] = TanCurvature(w[n.a]);
    if constexpr (n.op == Op::kSin) {
      const Wave wave(v[I], v[I + 1], Turns(v[n.a], w[n.a]));
      w[I] = wave.SineRange();
      w[I + 1] = wave.CosineRange();
    }
    if constexpr (n.op == Op::kCos) w[I] = Wave(v[I - 1], v[I], Turns(v[n.a], w[n.a])).CosineRange();
    if constexpr (n.op == Op::kTan) w[I] = TanRange(v[I], Turns(v[n.a], w[n.a]));
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

// @param z the center c. @param box contains c. Straight-line code, no branch but for angles above 1/4.
/** NominalModel::Expand for one program, with a pointer for each span. Cost: the program's operations; no branch except
for angles above 1/4. If the domain contains a pole, the ranges mean nothing, and the bounds of rounding.h are
infinite. */
template <const Program& kProgram>
FOREREACH_INLINE void Expand(const double* parameters, const double* z, const PlainInterval* box, Expansion& out) {
  constexpr auto kSize = ToSize(kProgram.size);
  std::array<double, kSize> v;
  std::array<PlainInterval, kSize> w;
  ForEachConstant<kSize>([&](auto i)
                             __attribute__((always_inline)) { EvaluateAtPoint<kProgram, i>(parameters, z, v.data()); });
  ForEachConstant<kSize>([&](auto i) __attribute__((always_inline)) {
    EvaluateOverBox<kProgram, i>(parameters, box, v.data(), w.data());
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
