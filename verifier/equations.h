/** The verifier's own evaluation of the nominal models. All are texts to it, the compiled ones by their rows in the
table of named models; it reads them by its own parser, and derives them by the rules of differentiation over intervals.
*/
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "forereach/dynamics/model.h"
#include "forereach/dynamics/model_text.h"
#include "verifier/real.h"

namespace forereach::verifier {

/** d f0_output / d z_variable. */
struct FirstDerivative {
  int output, variable;
  Real value;
};

/** d^2 f0_output / d z_row d z_column, row <= column < the number of states: the inputs of a step are points. */
struct SecondDerivative {
  int output, row, column;
  Real value;
};

/** f0 : z = (x, u) -> x+. Derivatives that are not listed are zero. Second derivatives are listed by output, column and
row, and whether one is listed depends on the equations alone, not on z: bounds on the remainder take some of them
together, by this list. For a box of z, each result contains the range. A
result is not finite where it has no finite enclosure: where the box meets a pole or the edge of a function's domain
and, for second derivatives, where it has a kink inside. With parameters that are intervals, each result contains those
for all their values; then Value is an interval at a point, too. */
class Equations {
 public:
  virtual ~Equations() = default;
  /** Whether f0 is one function: no parameter is an interval. */
  [[nodiscard]] virtual bool IsExact() const { return true; }
  [[nodiscard]] virtual std::vector<Real> Value(std::span<const Real> z) const = 0;
  [[nodiscard]] virtual std::vector<FirstDerivative> First(std::span<const Real> z) const = 0;
  [[nodiscard]] virtual std::vector<SecondDerivative> Second(std::span<const Real> z) const = 0;
  /** For each state the derivative of x+ by the step's duration, where that is in `duration` instead of dt. */
  [[nodiscard]] virtual std::vector<Real> Rate(std::span<const Real> z, const Real& duration) const = 0;
  /** The rates x' = f(x, u) of a model with an integrator; of another one what Rate is for a step of no duration. */
  [[nodiscard]] virtual std::vector<Real> Flow(std::span<const Real> z) const = 0;
  /** Whether x+_k - x_k is the step's duration times what does not depend on it, so that the derivative is
  (x+_k - x_k) / dt: true where docs/soundness.md, 3.15, says so, and only there. */
  [[nodiscard]] virtual bool IsProportional(int k) const = 0;
};

/** The equations of TextOf(model) (forereach/dynamics/models/named_models.h); null if there is no text.
@throws ExpressionError (expressions.h) if it is not a model in the language. */
[[nodiscard]] std::unique_ptr<Equations> EquationsOf(const NominalModel& model);

/** The equations of a text. @throws ExpressionError (expressions.h) if it is not a model in the language. */
[[nodiscard]] std::unique_ptr<Equations> EquationsOf(const ModelText& model);

}  // namespace forereach::verifier
