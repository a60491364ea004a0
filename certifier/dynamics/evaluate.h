/** Evaluates a program node by node over any scalar type: intervals for enclosures, extended precision for values. The
certify step uses expand.h instead. */
#pragma once

#include <array>
#include <cmath>
#include <span>

#include "certifier/dynamics/program.h"
#include "certifier/numerics/interval.h"
#include "certifier/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

template <class T>
using NodeValues = std::array<T, Program::kMaxOperations>;

inline long double sqr(long double x) { return x * x; }

/** 2 t (1 + t^2). It increases in t, so its range over an interval follows from the ends. */
inline long double TanCurvature(long double t) { return 2 * t * (1 + t * t); }
inline Interval TanCurvature(const Interval& t) {
  if (!t.IsFinite()) return Interval::Entire();
  const auto at = [](double end) { return Interval(2) * Interval(end) * (Interval(1) + sqr(Interval(end))); };
  return {at(t.lower).lower, at(t.upper).upper};
}

/** Sets values[i] for every node i with needed[i]. @param parameters the program's. @param z d_z entries. */
template <class T>
void Evaluate(const Program& program, const std::array<bool, Program::kMaxOperations>& needed,
              std::span<const double> parameters, std::span<const T> z, NodeValues<T>& values) noexcept {
  using std::sin, std::cos, std::tan;
  for (std::size_t i = 0; i < ToSize(program.size); ++i) {
    if (!needed[i]) continue;
    const Operation& node = program.nodes[i];
    const auto operand = [&](short j) -> const T& { return values[ToSize(j)]; };
    switch (node.op) {
      case Op::kVariable: values[i] = z[ToSize(node.a)]; break;
      case Op::kParameter: values[i] = T(parameters[ToSize(node.a)]); break;
      case Op::kConstant: values[i] = T(node.constant); break;
      case Op::kAdd: values[i] = operand(node.a) + operand(node.b); break;
      case Op::kSubtract: values[i] = operand(node.a) - operand(node.b); break;
      case Op::kMultiply: values[i] = operand(node.a) * operand(node.b); break;
      case Op::kDivide: values[i] = operand(node.a) / operand(node.b); break;
      case Op::kNegate: values[i] = -operand(node.a); break;
      case Op::kSquare: values[i] = sqr(operand(node.a)); break;
      case Op::kSin: values[i] = sin(operand(node.a)); break;
      case Op::kCos: values[i] = cos(operand(node.a)); break;
      case Op::kTan: values[i] = tan(operand(node.a)); break;
      case Op::kTanCurvature: values[i] = TanCurvature(operand(node.a)); break;
    }
  }
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
