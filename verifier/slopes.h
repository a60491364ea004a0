/** The verifier's own partial derivatives of a residual: by its own parser, and by the rules of differentiation over
intervals. */
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "forereach/dynamics/parametric_residual.h"
#include "verifier/functions.h"
#include "verifier/real.h"

namespace forereach::verifier {

/** A derivative over a box, and its own derivative by each argument of the box that is no point; empty if they were not
asked for. Real::Everything() where there is no finite enclosure. */
struct Slope {
  Real value;
  std::vector<Real> gradient;  ///< Entries beyond its end are zero.
};

class Slopes final {
 public:
  /** @throws ExpressionError (expressions.h) if the residual is not in the language.
  @throws std::invalid_argument unless it has one value for each state. */
  explicit Slopes(const ParametricResidual& residual);

  /** (row, column) of each derivative that is not identically zero. */
  [[nodiscard]] std::vector<std::pair<int, int>> Entries() const;
  /** d r_row / d z_column over a box, for one of the entries. At a kink it contains the derivatives of both sides. It
  is Everything where r_row may be undefined.
  @param w ranges of all coordinates z, then of the parameters. */
  [[nodiscard]] Slope At(int row, int column, std::span<const Real> w, bool with_gradient) const;

 private:
  Formulas formulas_;
  int num_variables_ = 0;
};

}  // namespace forereach::verifier
