#include "forereach/dynamics/angles.h"

#include <cmath>
#include <stdexcept>

#include "forereach/dynamics/expression.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

using Winding = std::optional<double>;

bool IsWhole(double x) { return x == std::floor(x) && std::isfinite(x); }

// How often the result of an operation on two windings winds. Nothing where that is not exactly a double.
Winding SumOfWindings(double a, double b) {
  const double sum = a + b;
  return sum - a == b && sum - b == a ? Winding(sum) : std::nullopt;
}
Winding ProductOfWindings(double a, double b) {
  const double product = a * b;
  return std::fma(a, b, -product) == 0 && std::abs(product) > 0x1p-500 ? Winding(product) : std::nullopt;
}
Winding Quotient(double a, double b) {
  const double quotient = a / b;
  return std::fma(quotient, b, -a) == 0 && std::abs(quotient) > 0x1p-500 ? Winding(quotient) : std::nullopt;
}

// Of an operation whose operands wind a and b times, not both 0.
Winding WindingOf(const Program& program, const Operation& n, double a, double b) {
  const auto constant = [&](int node) { return program.node(node).op == Op::kConstant; };
  switch (n.op) {
    case Op::kAdd: return SumOfWindings(a, b);
    case Op::kSubtract: return SumOfWindings(a, -b);
    case Op::kNegate: return -a;
    case Op::kMultiply:
      if (constant(n.a)) return ProductOfWindings(program.node(n.a).constant, b);
      return constant(n.b) ? ProductOfWindings(a, program.node(n.b).constant) : std::nullopt;
    case Op::kDivide: return constant(n.b) ? Quotient(a, program.node(n.b).constant) : std::nullopt;
    case Op::kSin:
    case Op::kCos: return IsWhole(a) ? Winding(0) : std::nullopt;
    case Op::kTan: return IsWhole(2 * a) ? Winding(0) : std::nullopt;
    default: return std::nullopt;
  }
}

}  // namespace

std::vector<Winding> Windings(const Program& program, int variable) {
  std::vector<Winding> windings;
  for (int i = 0; i < program.size; ++i) {
    const Operation& n = program.node(i);
    const Winding a = n.has_first() ? windings[ToSize(n.a)] : 0, b = n.has_second() ? windings[ToSize(n.b)] : 0;
    if (n.op == Op::kVariable)
      windings.emplace_back(n.a == variable ? 1 : 0);
    else if (a == 0.0 && b == 0.0)
      windings.emplace_back(0);
    else
      windings.push_back(a && b ? WindingOf(program, n, *a, *b) : std::nullopt);
  }
  return windings;
}

bool IsSameAfterTurn(const Program& program, int value, int angle) {
  return Windings(program, angle)[ToSize(program.value[ToSize(value)])] == 0.0;
}

void RequireSameAfterTurns(const Program& program, int value, const ExpressionText& text, const std::string& what,
                           const std::vector<int>& angles, const std::vector<std::string>& states) {
  for (const int angle : angles)
    if (!IsSameAfterTurn(program, value, angle))
      throw ExpressionError(text.line, text.column,
                            what + " is not seen to be the same after a turn of the angle " + states[ToSize(angle)] +
                                " by 2 pi: write it with sin, cos or tan of it");
}

void RequireAngles(const Program& program, const std::vector<int>& angles, const std::vector<std::string>& states,
                   bool of_rates) {
  std::vector<bool> seen(states.size());
  for (const int angle : angles) {
    if (angle < 0 || ToSize(angle) >= states.size() || seen[ToSize(angle)])
      throw std::invalid_argument("angles: index " + std::to_string(angle) + " is no state, or is there twice");
    seen[ToSize(angle)] = true;
    const std::vector<Winding> windings = Windings(program, angle);
    for (std::size_t k = 0; k < states.size(); ++k)
      if (windings[ToSize(program.value[k])] != (!of_rates && ToSize(angle) == k ? 1.0 : 0.0))
        throw TurnError(static_cast<int>(k), "angles: " + states[ToSize(angle)] + ": the equation of " + states[k] +
                                                 " is not seen to be the same after a turn of it by 2 pi; an angle may "
                                                 "stand in sin, cos and tan" +
                                                 (of_rates ? "" : ", and as a term of its own equation"));
  }
}

}  // namespace forereach
