/** The verifier's own equations of the nominal models, with hand-written first and second derivatives. */
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "certifier/dynamics/model.h"
#include "verifier/real.h"

namespace forereach::verifier {

/** d f0_output / d z_variable. */
struct FirstDerivative {
  int output, variable;
  Real value;
};

/** d^2 f0_output / d z_row d z_column, row <= column. */
struct SecondDerivative {
  int output, row, column;
  Real value;
};

/** f0 : z = (x, u) -> x+. Derivatives that are not listed are zero. For a box of z, each result contains the range. */
class Equations {
 public:
  virtual ~Equations() = default;
  [[nodiscard]] virtual std::vector<Real> Value(std::span<const Real> z) const = 0;
  [[nodiscard]] virtual std::vector<FirstDerivative> First(std::span<const Real> z) const = 0;
  [[nodiscard]] virtual std::vector<SecondDerivative> Second(std::span<const Real> z) const = 0;
};

/** The equations for a model's name and parameters; null for a model that the verifier does not implement. */
[[nodiscard]] std::unique_ptr<Equations> EquationsOf(const NominalModel& model);

}  // namespace forereach::verifier
