/** A value with its gradient, both as intervals, for derivatives by the chain rule. */
#pragma once

#include <cstddef>
#include <vector>

#include "verifier/real.h"

namespace forereach::verifier {

struct Dual {
  Real value;
  std::vector<Real> gradient;  ///< Entries beyond its end are zero.

  Dual() = default;
  Dual(double constant) : value(constant) {}  // NOLINT: as numbers do
  explicit Dual(Real constant) : value(std::move(constant)) {}
  /** The variable with this index in the gradient. */
  [[nodiscard]] static Dual Variable(const Real& range, std::size_t place);
};

[[nodiscard]] Dual operator+(const Dual& a, const Dual& b);
[[nodiscard]] Dual operator-(const Dual& a, const Dual& b);
[[nodiscard]] Dual operator*(const Dual& a, const Dual& b);
[[nodiscard]] Dual operator/(const Dual& a, const Dual& b);
[[nodiscard]] Dual sqr(const Dual& a);
[[nodiscard]] Dual sqrt(const Dual& a);
/** |a|. If a may be zero, the gradient contains those of both sides. */
[[nodiscard]] Dual abs(const Dual& a);
[[nodiscard]] Dual tan(const Dual& a);

/** phi(e) = exp(-1/e) for e > 0 and 0 for e <= 0, and its derivative phi'. */
[[nodiscard]] Dual Gate(const Dual& e);
[[nodiscard]] Dual GateSlope(const Dual& e);

/** t log(1 + exp(x / t)), which increases in x and t, and its derivative by x, the logistic function of x / t. @pre t >
0. */
[[nodiscard]] Dual SoftRamp(const Dual& x, const Dual& t);
[[nodiscard]] Dual SoftStep(const Dual& x, const Dual& t);

}  // namespace forereach::verifier
