/** Reachability of Lipschitz nonlinear systems from data: Alanwar, Koch, Allgoewer & Johansson, "Data-driven
reachability analysis from noisy data", IEEE TAC 2023, Algorithm 6.

The algorithm fits an affine model M' to the data by least squares, encloses what the fit leaves at the data in a box
Z_L, and adds a box Z_eps for what may happen between the data, the Lipschitz constant times the covering radius of the
data in the set that the queries come from. Here it bounds the residual, as a peer of the envelope: r_k(z) in  M'_k z +
[min_i (r~_ik - sigma_k - M'_k z_i), max_i (r~_ik + sigma_k - M'_k z_i)] + [-eps_k, eps_k], eps_k = sup_{z in Z_cert}
min_i sum_l (L_kl + |M'_kl|) |z_l - z_il|. Where the two papers leave a choice:
- the fit is of r, not of f: with f0 in the Propagator the comparison is of the residual's bound alone;
- regressors of row k are the coordinates that L_k names; an affine least-squares fit does not depend on the point it
  is written around, so one M' serves all steps;
- the covering radius is that of the certification domain, in the declaration's own distance, componentwise;
- the difference r - M' between data is bounded by L + |M'|, and by eps_k in full, where the original has L* delta / 2:
  with delta the distance to the nearest sample, the half of it would not be enough. */
#pragma once

#include <memory>
#include <vector>

#include "forereach/numerics/interval.h"
#include "research/methods/method.h"

namespace forereach::research {

/** Claims: contains r_k(z) for every z of the query, if the declaration holds. Sound, rounded outward: r - M' satisfies
the Lipschitz bound L + |M'|, and each z of the domain has an observation within eps_k. */
class AlanwarEnclosure final : public ResidualEnclosure {
 public:
  /** Cost: a least-squares fit and a covering radius (covering.h) for each row of L with columns. */
  explicit AlanwarEnclosure(const Setting& setting);

  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;

  /** M'_k, d_z entries. */
  [[nodiscard]] const std::vector<double>& slopes(int k) const { return rows_[static_cast<std::size_t>(k)].slopes; }
  [[nodiscard]] double covering(int k) const { return rows_[static_cast<std::size_t>(k)].covering; }

 private:
  struct Row {
    std::vector<double> slopes;  // M'_k
    Interval leftover;           // Z_L
    double covering;             // eps_k
  };
  std::vector<Row> rows_;
};

[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeAlanwar(const Setting& setting);

}  // namespace forereach::research
