/** Interval enclosures of an expression f, of its derivative df/dc along one coordinate c, and of the gradients of
both, by the chain rule. ResidualSlopes uses them to bound a partial derivative over a box.

A kink (of abs, min or max) has no derivative. Over a box that contains a kink, `slope` and `gradient` contain Clarke's
generalised gradient at every point, which is sufficient for a Lipschitz bound. The second derivatives are unbounded
there, so `slope` cannot be expanded by the mean-value form.

If f may be undefined at a point of the box (a division by zero, a logarithm of a negative number), `value` is
[-inf, inf], whatever the derivatives are. Derivatives count only where `value` is finite. */
#pragma once

#include <array>

#include "forereach/numerics/interval.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"

namespace forereach {

struct Jet {
  static constexpr int kMaxArguments = kMaxVariables;
  using Row = std::array<Interval, kMaxArguments>;

  Interval value{0.0}, slope{0.0};  ///< f and df/dc.
  Row gradient = {},
      curvature = {};  ///< df/dw_i and d(df/dc)/dw_i for the first `size` arguments; zero for the others.
  int size = 0;

  Jet() = default;
  Jet(double constant) : value(constant) {}  // NOLINT: a number is an expression
  explicit Jet(const Interval& constant) : value(constant) {}

  /** The argument w_index over a range. @param is_coordinate whether w_index is c. */
  [[nodiscard]] static Jet Argument(const Interval& range, int index, bool is_coordinate) {
    Jet jet(range);
    jet.slope = is_coordinate ? 1.0 : 0.0;
    jet.gradient[ToSize(index)] = 1.0;
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
/** a |a|: its second derivative by a is -2, 2, or at 0 whatever is between. */
[[nodiscard]] Jet SignedSquare(const Jet& a);
[[nodiscard]] Jet min(const Jet& a, const Jet& b);
[[nodiscard]] Jet max(const Jet& a, const Jet& b);
[[nodiscard]] Jet sqrt(const Jet& a);
[[nodiscard]] Jet exp(const Jet& a);
[[nodiscard]] Jet log(const Jet& a);
[[nodiscard]] Jet sin(const Jet& a);
[[nodiscard]] Jet cos(const Jet& a);
[[nodiscard]] Jet tan(const Jet& a);
[[nodiscard]] Jet asin(const Jet& a);
[[nodiscard]] Jet acos(const Jet& a);
[[nodiscard]] Jet atan(const Jet& a);
[[nodiscard]] Jet atan2(const Jet& y, const Jet& x);
[[nodiscard]] Jet tanh(const Jet& a);
[[nodiscard]] Jet pow(const Jet& a, int n);
[[nodiscard]] inline Jet sqr(const Jet& a) { return a * a; }
/** The functions of the same names in saturation.h. */
[[nodiscard]] Jet SmoothGate(const Jet& a);
[[nodiscard]] Jet Softplus(const Jet& x, const Jet& temperature);
/** What derivatives in a program consist of (elementary.h, evaluate.h). Where one has a jump, nothing is bounded. */
[[nodiscard]] Jet step(const Jet& a);
[[nodiscard]] Jet sign(const Jet& a);
[[nodiscard]] Jet kink(const Jet& a);
[[nodiscard]] Jet cut(const Jet& y, const Jet& x);
[[nodiscard]] Jet TanCurvature(const Jet& t);

}  // namespace forereach
