/** The verifier's own partial derivatives of the residuals, hand-written from the paper's formulas, Eqs.
(bicycle-certified-partials) and (pointmass-residual-jacobian). */
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

  /** (row, column) of each derivative that is not identically zero. */
  [[nodiscard]] virtual std::vector<std::pair<int, int>> Entries() const = 0;
  /** d r_row / d z_column or its absolute value, for one of the entries.
  @param z all d_z coordinates. @param p the parameters, in the residual's order. */
  [[nodiscard]] virtual Dual At(int row, int column, std::span<const Dual> z, std::span<const Dual> p) const = 0;
};

/** The slopes for a residual's name and parameter names; null for a residual that the verifier does not implement. */
[[nodiscard]] std::unique_ptr<Slopes> SlopesOf(const ParametricResidual& residual);

}  // namespace forereach::verifier
