/** The safety projection P : R^n -> R^p, p = 1, 2 or 3. */
#pragma once

#include <vector>

#include "certifier/safety/separation.h"
#include "certifier/sets/eigen.h"
#include "certifier/sets/linear_map.h"

namespace forereach {

class Projection final {
 public:
  /** @throws std::invalid_argument unless P is p-by-num_states with p = 1..3, finite and not zero. */
  Projection(const Eigen::MatrixXd& matrix, int num_states);

  [[nodiscard]] int dim() const { return dim_; }

  /** Encloses the interval hull of P X, given X's center and upper bounds on its hull's half-widths. */
  [[nodiscard]] Hull EncloseHull(const Zonotope& slice, std::span<const double> half_width) const noexcept;

  /** A zonotope that contains P X; exactly P X where each row of P copies a coordinate. */
  void Enclose(const Zonotope& slice, std::span<const double> half_width, Zonotope& projected) const noexcept {
    EncloseLinearImage(entries_, slice, half_width, dim_, projected);
  }

 private:
  int dim_;
  std::vector<MatrixEntry> entries_;
};

}  // namespace forereach
