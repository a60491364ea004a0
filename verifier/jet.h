/** Values of a tape over a box of variables, with first and second derivatives, as intervals.

Derivatives go forward with the values, by the rules of the sum, product and quotient. Over a box the order of the
operations matters, and it is that of the certifier's derivatives: a tighter range moves the center of a centred
remainder, and then the condition of containment.h may no longer show that the record's generators span the slice.
Where a quantity has no finite enclosure (a pole, the edge of a function's domain), it and all that is computed
from it is Real::Everything(). Where a function has a kink (abs, min, max) inside the box, its first derivatives are the
hulls of those of both sides, and its second derivatives are Real::Everything(). */
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "verifier/tape.h"

namespace forereach::verifier {

/** Entries that may be nonzero, in ascending order of their keys. */
using Sparse = std::vector<std::pair<int, Real>>;

struct Jet {
  Real value;
  Sparse first;   ///< By the variable.
  Sparse second;  ///< By JetArithmetic::Key(i, j), i <= j.
};

/** For Evaluate: plain values. */
class RealArithmetic final {
 public:
  using Number = Real;

  /** @param variables, parameters their ranges; must outlive this object. */
  RealArithmetic(std::span<const Real> variables, std::span<const Real> parameters)
      : variables_(variables), parameters_(parameters) {}

  [[nodiscard]] Real Apply(const Tape::Operation& operation, const Real* a, const Real* b) const;

 private:
  std::span<const Real> variables_, parameters_;
};

/** For Evaluate: values with their derivatives by some of the variables. */
class JetArithmetic final {
 public:
  using Number = Jet;
  enum class Order { kFirst, kSecond };

  /** @param by for each variable, whether there are derivatives by it; none by those beyond its end. */
  JetArithmetic(std::span<const Real> variables, std::span<const Real> parameters, std::vector<bool> by, Order order)
      : values_(variables, parameters), by_(std::move(by)), order_(order) {}
  /** By the first `count` variables. */
  JetArithmetic(std::span<const Real> variables, std::span<const Real> parameters, int count, Order order)
      : JetArithmetic(variables, parameters, std::vector<bool>(static_cast<std::size_t>(count), true), order) {}

  [[nodiscard]] Jet Apply(const Tape::Operation& operation, const Jet* a, const Jet* b) const;

  static constexpr int kStride = 1024;  ///< More than there are variables.
  [[nodiscard]] static constexpr int Key(int i, int j) { return kStride * i + j; }

 private:
  RealArithmetic values_;
  std::vector<bool> by_;
  Order order_;
};

/** outer(inner): the jet of a function of the variables that are the inner jets, by what those have derivatives by.
With H the second derivatives of outer, grouped as sum_l f_l D^2 y_l + sum_{a <= b} H_ab (D y_a D y_b^T + D y_b D
y_a^T), where the second product is left out if a = b. Each product is that of centers and radii. */
[[nodiscard]] Jet Compose(const Jet& outer, std::span<const Jet> inner, JetArithmetic::Order order);

/** a + factor b. */
[[nodiscard]] Jet AddScaled(const Jet& a, const Real& factor, const Jet& b);

}  // namespace forereach::verifier
