/** The residuals' partial derivatives once more, by the paper's formulas, Eqs. (bicycle-certified-partials) and
(pointmass-residual-jacobian), written out by hand. */
#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "certifier/dynamics/parametric_residual.h"
#include "verifier/dual.h"

namespace forereach::verifier {

class Slopes {
 public:
  virtual ~Slopes() = default;

  /** (row, column) of each derivative that is not zero everywhere. */
  [[nodiscard]] virtual std::vector<std::pair<int, int>> Entries() const = 0;
  /** |d r_row / d z_column| or d r_row / d z_column itself, of one of the entries.
  @param z the coordinates, all of them. @param p the parameters, in the residual's order. */
  [[nodiscard]] virtual Dual At(int row, int column, std::span<const Dual> z, std::span<const Dual> p) const = 0;
};

/** By the residual's name and its parameters' names; nothing for one that the verifier does not know. */
[[nodiscard]] std::unique_ptr<Slopes> SlopesOf(const ParametricResidual& residual);

}  // namespace forereach::verifier
