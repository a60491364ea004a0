/** The set-membership envelope of all observations, Eq. (set-envelope):
    lower_k(Z) = max_i [r~_ik - sigma_k - D_ik(Z)],   upper_k(Z) = min_i [r~_ik + sigma_k + D_ik(Z)],
with D_ik(Z) the worst-case Lipschitz distance from the query set to observation i, Eq. (zonotope-set-distance).

Any subset of the observations gives a sound envelope. So the search for the tightest observation runs in plain
arithmetic, and only the bound of the one it finds is computed with outward rounding. */
#pragma once

#include <vector>

#include "certifier/residual/declaration.h"
#include "certifier/residual/enclosure.h"
#include "certifier/residual/observations.h"

namespace forereach {

class LipschitzEnvelope final : public ResidualEnclosure {
 public:
  /** Up to this many nonzero columns of a row, D_ik is exact, by all signs. Above, it is bounded over the interval hull
  of the query set, which is sound and wider; uses_hull_distance() says so. */
  static constexpr int kMaxExactColumns = 12;

  /** @pre declaration.Validate passed and observations is not empty. */
  LipschitzEnvelope(const Declaration& declaration, const Observations& observations);

  /** Cost O(2^(a-1) a (N + m)) for a row of L with a nonzero columns, N observations, m generators. */
  void Enclose(const QuerySet& set, ResidualBounds& bounds) const noexcept override;

  [[nodiscard]] bool uses_hull_distance() const { return uses_hull_distance_; }

 private:
  struct Column {
    int variable;                   // index into z
    double slope;                   // L_kl > 0
    std::vector<double> locations;  // z_il of every observation
  };
  // A coordinate of the residual. Without columns it is declared constant.
  struct Row {
    std::vector<Column> columns;
    std::vector<double> lower, upper;  // r~_ik - sigma_k and r~_ik + sigma_k of every observation, outward
  };
  struct Query;

  static void Prepare(const Row& row, const QuerySet& set, Query& query) noexcept;
  static double DistanceUpper(const Row& row, const Query& query, std::size_t observation) noexcept;
  static void EncloseRow(const Row& row, const Query& query, double& lower, double& upper) noexcept;

  std::vector<Row> rows_;
  bool uses_hull_distance_ = false;
};

}  // namespace forereach
