/** Expressions as the verifier evaluates them: elementary operations in the order in which they are computed. */
#pragma once

#include <map>
#include <span>
#include <vector>

#include "verifier/real.h"

namespace forereach::verifier {

enum class Op {
  kVariable,   ///< Variable `index`.
  kParameter,  ///< Parameter `index`: a constant that is known to lie in an interval.
  kNumber,     ///< `number`
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kNegate,
  kPower,  ///< a^index
  kSin,
  kCos,
  kTan,
  kAsin,
  kAcos,
  kAtan,
  kSqrt,
  kExp,
  kLog,
  kTanh,
  kAbs,
  kSignedSquare,  ///< a |a|
  kAtan2,         ///< The angle of the point (b, a).
  kMin,
  kMax,
  kSoftplus,   ///< b log(1 + exp(a / b)), b > 0.
  kSmoothGate  ///< exp(-1/a) for a > 0 and 0 for a <= 0.
};

/** Operations, each on the results of earlier ones. Equal operations are one. */
class Tape final {
 public:
  struct Operation {
    Op op = Op::kNumber;
    int a = -1, b = -1;  ///< Places of the operands; -1: none.
    int index = 0;
    double number = 0;
  };

  /** The place of this operation's result. @pre its operands are places of this tape. */
  int Add(const Operation& operation);
  int Add(Op op, int a, int b = -1) { return Add({op, a, b}); }
  int Number(double number) { return Add({Op::kNumber, -1, -1, 0, number}); }

  [[nodiscard]] int size() const { return static_cast<int>(operations_.size()); }
  [[nodiscard]] const Operation& at(int place) const { return operations_[static_cast<std::size_t>(place)]; }

  /** For each place the last operation that uses its result, size() if it is among `results`, and -1 if the results do
  not depend on it. */
  [[nodiscard]] std::vector<int> LastUses(std::span<const int> results) const;

 private:
  struct Order {
    bool operator()(const Operation& a, const Operation& b) const;
  };
  std::vector<Operation> operations_;
  std::map<Operation, int, Order> places_;
};

/** Evaluates a tape.
@param results the places that are wanted.
@param arithmetic has a type Number and Number Apply(operation, a, b), with null for an operand that there is none of.
*/
template <class Arithmetic>
[[nodiscard]] std::vector<typename Arithmetic::Number> Evaluate(const Tape& tape, std::span<const int> results,
                                                                const Arithmetic& arithmetic) {
  using Number = typename Arithmetic::Number;
  const std::vector<int> last_use = tape.LastUses(results);
  std::vector<Number> numbers(last_use.size());
  const auto at = [&](int place) { return place < 0 ? nullptr : &numbers[static_cast<std::size_t>(place)]; };
  for (int i = 0; i < tape.size(); ++i) {
    if (last_use[static_cast<std::size_t>(i)] < 0) continue;
    const Tape::Operation& operation = tape.at(i);
    *at(i) = arithmetic.Apply(operation, at(operation.a), at(operation.b));
    for (const int operand : {operation.a, operation.b})  // what is used no more gives its memory back
      if (operand >= 0 && last_use[static_cast<std::size_t>(operand)] == i) *at(operand) = Number();
  }
  std::vector<Number> wanted;
  for (const int place : results) wanted.push_back(*at(place));
  return wanted;
}

}  // namespace forereach::verifier
