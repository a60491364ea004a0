/** The affine declaration: r(z) = M z + b without further bounds. Its consistency set, Eq. (affine-consistency-set),
    A = {(M, b) : |r~_ik - (M z_i + b)_k| <= sigma_k for all i, k},
is a polytope for each coordinate k; the declaration is refuted where it is empty, and bounded where the regressors have
full rank. ForeReach's own sets of affine rows (affine_set.h) bound it. */
#pragma once

#include <memory>
#include <vector>

#include "forereach/residual/affine_set.h"
#include "research/methods/method.h"

namespace forereach::research {

/** Claims: contains r_k(z) for every z of the query, if r is affine in the coordinates that L names and constant in the
others: the image of A over Box(Z), Eq. (affine-residual-envelope), largest at corners, since a support function is
convex. Sound. An empty A gives an empty bound, lower above upper. */
class AffineEnclosure final : public ResidualEnclosure {
 public:
  /** @throws std::invalid_argument if L names more than 10 coordinates. Cost: AffineSet::Derive for each k. */
  explicit AffineEnclosure(const Setting& setting);

  /** Cost: 2^a times AffineSet::Enclose for each coordinate. */
  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;

  /** False only where it is proven that no (M, b) agrees with all observations. */
  [[nodiscard]] bool IsConsistent() const;

 private:
  std::vector<int> active_;
  std::vector<AffineSet> sets_;  // A of each coordinate
};

[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeAffine(const Setting& setting);

}  // namespace forereach::research
