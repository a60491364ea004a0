/** The safety projection P : R^n -> R^p with p = 1, 2 or 3, from states to safety coordinates in metres. */
#pragma once

#include <vector>

#include "forereach/safety/separation.h"
#include "forereach/sets/eigen.h"
#include "forereach/sets/linear_map.h"

namespace forereach {

class Projection final {
 public:
  /** @throws std::invalid_argument unless P is p-by-num_states with p = 1..3 and finite. */
  Projection(const Eigen::MatrixXd& matrix, int num_states);

  [[nodiscard]] int dim() const { return dim_; }
  /** The nonzero entries of P. */
  [[nodiscard]] std::span<const MatrixEntry> entries() const { return entries_; }

  /** A hull that contains Box(P X). It depends only on the center of X and on the half-widths of its hull.
  @param half_width n upper bounds on the half-widths of Box(X). Cost O(nonzeros of P). */
  void EncloseHull(const Zonotope& slice, std::span<const double> half_width, Hull& hull) const noexcept;

  /** Sets `projected` to a zonotope that contains P X. It equals P X if each row of P copies a coordinate.
  Its slack is zero: that of X is generators here, so that a search for a direction sees it. @param half_width as in
  EncloseHull. Cost O(nonzeros of P * generators). @pre X has at most kMaxGenerators - p generators. */
  void Enclose(const Zonotope& slice, std::span<const double> half_width, Zonotope& projected) const noexcept;

 private:
  int dim_;
  bool copies_;  // each row of P copies a coordinate
  std::vector<MatrixEntry> entries_;
};

}  // namespace forereach
