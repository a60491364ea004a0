/** Evaluates a program node by node over any scalar type: intervals for enclosures, extended precision for values. The
certify step uses expand.h instead. */
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "forereach/dynamics/program.h"
#include "forereach/dynamics/saturation.h"
#include "forereach/numerics/elementary.h"
#include "forereach/numerics/interval.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

/** Room for the values of `count` nodes on the stack of the calling function: a step has no heap. A draft has at most
ProgramDraft::kMaxOperations nodes. */
#define FOREREACH_ON_STACK(T, count) static_cast<T*>(__builtin_alloca_with_align(sizeof(T) * ToSize(count), 512))

namespace forereach {

inline long double sqr(long double x) { return x * x; }
inline long double step(long double x) { return x > 0 ? 1 : 0; }
inline long double sign(long double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }
inline long double kink(long double) { return 0; }
inline long double cut(long double, long double) { return 0; }

/** 2 t (1 + t^2). It increases in t, so its range over an interval follows from the ends. */
inline long double TanCurvature(long double t) { return 2 * t * (1 + t * t); }
inline Interval TanCurvature(const Interval& t) {
  if (!t.IsFinite()) return Interval::Entire();
  const auto at = [](double end) { return Interval(2) * Interval(end) * (Interval(1) + sqr(Interval(end))); };
  return {at(t.lower).lower, at(t.upper).upper};
}

/** Sets values[i] for every node i with needed[i] != 0. P is double or Interval; T is made of it.
@param parameters the program's. @param z d_z entries. @param values program.size entries. */
template <class T, class P>
void Evaluate(const Program& program, std::span<const unsigned char> needed, std::span<const P> parameters,
              std::span<const T> z, std::span<T> values) noexcept {
  using std::pow, std::sin, std::cos, std::tan, std::sqrt, std::exp, std::log, std::asin, std::acos, std::atan,
      std::atan2, std::tanh, std::abs, std::min, std::max;
  for (std::size_t i = 0; i < ToSize(program.size); ++i) {
    if (needed[i] == 0) continue;
    const Operation& node = program.nodes[i];
    const T &a = values[node.has_first() ? ToSize(node.a) : 0], &b = values[node.has_second() ? ToSize(node.b) : 0];
    switch (node.op) {
      case Op::kVariable: values[i] = z[ToSize(node.a)]; break;
      case Op::kParameter: values[i] = T(parameters[ToSize(node.a)]); break;
      case Op::kConstant: values[i] = T(node.constant); break;
      case Op::kAdd: values[i] = a + b; break;
      case Op::kSubtract: values[i] = a - b; break;
      case Op::kMultiply: values[i] = a * b; break;
      case Op::kDivide: values[i] = a / b; break;
      case Op::kNegate: values[i] = -a; break;
      case Op::kSquare: values[i] = sqr(a); break;
      case Op::kSin: values[i] = sin(a); break;
      case Op::kCos: values[i] = cos(a); break;
      case Op::kTan: values[i] = tan(a); break;
      case Op::kTanCurvature: values[i] = TanCurvature(a); break;
      case Op::kPower: values[i] = pow(a, node.b); break;
      case Op::kSqrt: values[i] = sqrt(a); break;
      case Op::kExp: values[i] = exp(a); break;
      case Op::kLog: values[i] = log(a); break;
      case Op::kAsin: values[i] = asin(a); break;
      case Op::kAcos: values[i] = acos(a); break;
      case Op::kAtan: values[i] = atan(a); break;
      case Op::kAtan2: values[i] = atan2(a, b); break;
      case Op::kTanh: values[i] = tanh(a); break;
      case Op::kAbs: values[i] = abs(a); break;
      case Op::kSignedSquare: values[i] = SignedSquare(a); break;
      case Op::kMin: values[i] = min(a, b); break;
      case Op::kMax: values[i] = max(a, b); break;
      case Op::kSign:
      case Op::kSlopeOfAbs: values[i] = sign(a); break;
      case Op::kStep: values[i] = step(a); break;
      case Op::kKink: values[i] = kink(a); break;
      case Op::kCut: values[i] = cut(a, b); break;
      case Op::kSoftplus: values[i] = Softplus(a, b); break;
      case Op::kSmoothGate: values[i] = SmoothGate(a); break;
    }
  }
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
