/** The affine declaration: r(z) = M z + b without further bounds. Its consistency set, Eq. (affine-consistency-set),
    A = {(M, b) : |r~_ik - (M z_i + b)_k| <= sigma_k for all i, k},
is a polytope for each coordinate k; the declaration is refuted where it is empty, and bounded where the regressors have
full rank. Linear programs over it by Clp. */
#pragma once

#include <memory>
#include <vector>

#include "research/methods/method.h"

namespace forereach::research {

/** Claims: contains r_k(z) for every z of the query, if r is affine in the coordinates that L names and constant in the
others: the image of A over Box(Z), Eq. (affine-residual-envelope), largest at corners, since a support function is
convex. Sound to the solver's tolerance, which is added. An empty A gives an empty bound, lower above upper. */
class AffineEnclosure final : public ResidualEnclosure {
 public:
  /** @throws std::invalid_argument if L names more than 10 coordinates. Cost: a linear program of N rows for each k. */
  explicit AffineEnclosure(const Setting& setting);
  ~AffineEnclosure() override;

  /** Cost: 2^(a + 1) linear programs for each coordinate, each from the last one's basis. */
  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;

  /** False only where the solver proved that no (M, b) agrees with all observations, within its tolerance. */
  [[nodiscard]] bool IsConsistent() const;

 private:
  class Row;  // A of one coordinate
  std::vector<int> active_;
  std::vector<std::unique_ptr<Row>> rows_;
};

[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeAffine(const Setting& setting);

}  // namespace forereach::research
