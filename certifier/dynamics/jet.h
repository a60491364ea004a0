/** Interval enclosures of an expression, of its derivative along one coordinate, and of the gradients of both, by the
chain rule: what bounding a partial derivative over a box takes.

A kink (abs, min, max) has no derivative. Over a box that meets one, `slope` and `gradient` contain Clarke's generalised
gradient at every point, which is what a Lipschitz bound needs; the second derivatives are then unbounded, and whoever
wants to expand `slope` sees that he cannot. */
#pragma once

#include <array>

#include "certifier/numerics/interval.h"

namespace forereach {

struct Jet {
  static constexpr int kMaxArguments = 16;
  using Row = std::array<Interval, kMaxArguments>;

  Interval value{0.0}, slope{0.0};    ///< f and df/dc, c the coordinate.
  Row gradient = {}, curvature = {};  ///< df/dw_i and d(df/dc)/dw_i for the first `size` arguments; else zero.
  int size = 0;

  Jet() = default;
  Jet(double constant) : value(constant) {}  // NOLINT: a number is an expression
  explicit Jet(const Interval& constant) : value(constant) {}

  /** The argument w_index over a range. @param is_coordinate whether it is c. */
  [[nodiscard]] static Jet Argument(const Interval& range, int index, bool is_coordinate) {
    Jet jet(range);
    jet.slope = is_coordinate ? 1.0 : 0.0;
    jet.gradient[static_cast<std::size_t>(index)] = 1.0;
    jet.size = index + 1;
    return jet;
  }
};

[[nodiscard]] Jet operator+(const Jet& a, const Jet& b);
[[nodiscard]] Jet operator-(const Jet& a, const Jet& b);
[[nodiscard]] Jet operator*(const Jet& a, const Jet& b);  ///< A square if both are the same object.
[[nodiscard]] Jet operator/(const Jet& a, const Jet& b);
[[nodiscard]] Jet operator-(const Jet& a);
[[nodiscard]] Jet abs(const Jet& a);
[[nodiscard]] Jet min(const Jet& a, const Jet& b);
[[nodiscard]] Jet max(const Jet& a, const Jet& b);
[[nodiscard]] Jet sqrt(const Jet& a);
[[nodiscard]] Jet exp(const Jet& a);
[[nodiscard]] Jet sin(const Jet& a);
[[nodiscard]] Jet cos(const Jet& a);
[[nodiscard]] Jet tan(const Jet& a);
/** Of residuals.h. */
[[nodiscard]] Jet SmoothGate(const Jet& a);
[[nodiscard]] Jet Softplus(const Jet& x, const Jet& temperature);

}  // namespace forereach
