/** The nominal models' equations once more, with first and second derivatives written out by hand. */
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

/** f0 : z = (x, u) -> x+. Derivatives that are not listed are zero. Over a box of z each result contains its range. */
class Equations {
 public:
  virtual ~Equations() = default;
  [[nodiscard]] virtual std::vector<Real> Value(std::span<const Real> z) const = 0;
  [[nodiscard]] virtual std::vector<FirstDerivative> First(std::span<const Real> z) const = 0;
  [[nodiscard]] virtual std::vector<SecondDerivative> Second(std::span<const Real> z) const = 0;
};

/** By the model's name and parameters; nothing for a model that the verifier does not know. */
[[nodiscard]] std::unique_ptr<Equations> EquationsOf(const NominalModel& model);

}  // namespace forereach::verifier
