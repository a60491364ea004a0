/** The set-membership envelope of all observations, Eq. (set-envelope):
    lower_k(Z) = max_i [r~_ik - eps_k - D_ik(Z)],   upper_k(Z) = min_i [r~_ik + eps_k + D_ik(Z)],
with eps_k = sigma_k + w^_k, the error and the disturbance of the observed step (declaration.h), and D_ik(Z) the
worst-case Lipschitz distance from the query set to observation i, Eq. (zonotope-set-distance).

Rounding. A query runs in plain arithmetic; its error is bounded before there is a query, once per row, because the
query's hull lies in the certification domain. The computed bound is an expression of sums, products of two, |.| and max
whose leaves are r~_ik -+ eps_k (rounded outward once, then taken as exact), L_kl c_l, L_kl z_il, L_kl G_lj and L_kl
s_l. Over all queries their magnitudes add up to at most
    V + 2 S + 3 W,   V >= max_i |r~_ik| + eps_k,  S = sum_l L_kl max |z_l|,  W = sum_l L_kl R_l,
with max |z_l| over the domain and the observations, and R_l half the domain's width, which bounds sum_j |G_lj| + s_l.
V is a power of two, so that few observations raise it (RaiseLimits): all indexes of a store have the same one.
(W counts three times because (w_s - w_0) + w_0 is computed in place of w_s.) In a row with a columns no leaf passes
more than a + 24 roundings, because sums over generators run in eight lanes. With u = 2^-53 the error is below
    E_k = 2 (a + 24) u (V + 2 S + 3 W) + one smallest double for each product that may underflow,
evaluated upward. So lower_k - E_k and upper_k + E_k are bounds in real arithmetic. If E_k is not finite, neither are
the bounds.

Work. Any subset of the observations gives a sound envelope, so a search may stop early. */
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/declaration.h"
#include "forereach/residual/enclosure.h"
#include "forereach/residual/lipschitz_row.h"
#include "forereach/residual/observation_index.h"
#include "forereach/residual/observations.h"

namespace forereach {

struct EnvelopeOptions {
  /** The number of leaves of 32 observations that the search for one coordinate may visit, 1 to 2^20. It may also try
  64 sign patterns a leaf. A search that meets a limit gives wider bounds and sets `capped`. Only data made for this
  purpose are known to meet one. */
  int max_leaf_visits = 512;
  /** Up to this many blocks, a query scans all of them and skips the tree. */
  int max_flat_blocks = 16;
  InstructionSet instructions = BestInstructionSet();  ///< Changes the time a query takes, never a bit of its result.
};

class EnvelopeTail;

class LipschitzEnvelope final : public ResidualEnclosure {
 public:
  /** For a row of L with at most this many nonzero columns, D_ik is exact. With more columns it is bounded over the
  interval hull of the query set, which is sound and wider; then uses_hull_distance() is true. */
  static constexpr int kMaxExactColumns = 12;

  /** @param domain_lower, domain_upper d_z entries each: a box that contains the hull of every query.
  @tparam Rows Observations or LastRows, which are read by number.
  @pre declaration.Validate passed and observations is not empty. Cost: ObservationIndex, for each row with columns. */
  template <class Rows>
  LipschitzEnvelope(const Declaration& declaration, const Rows& observations, std::span<const double> domain_lower,
                    std::span<const double> domain_upper, const EnvelopeOptions& options = {});

  /** As ResidualEnclosure; never sets a slope. No heap, lock or exception. Cost for a row of L with a nonzero columns
  and m generators:
  - a <= 3: O(2^(a-1) m), then O(2^(a-1)) for each block visited;
  - a > 3: O(a m), then O(a) for each block visited; and up to a = 12, O(2^f m) for each observation that lies within
  the half-width of the query set in f columns. In practice some dozens of blocks are visited, whatever the number of
  observations. */
  void Enclose(const QuerySet& set, ResidualBounds& bounds) const noexcept override;

  /** The envelope of its own observations and the first `count` of the tail, which are all scanned.
  @pre the tail was made for this envelope, and count <= tail.size() as read in this thread. */
  void Enclose(const QuerySet& set, const EnvelopeTail& tail, int count, ResidualBounds& bounds) const noexcept;

  /** Makes E_k hold for further observations, if |r~_ik| + eps_k <= values[k], n entries. Cost O(n). A copy shares the
  indexes. */
  void RaiseLimits(std::span<const double> values);

  [[nodiscard]] int num_states() const { return static_cast<int>(rows_.size()); }
  [[nodiscard]] const LipschitzRow& row(int k) const { return rows_[ToSize(k)].distance; }
  /** Has no entries if row k is constant. */
  [[nodiscard]] const ObservationIndex& index(int k) const { return *rows_[ToSize(k)].index; }
  /** The highest floor and the lowest ceiling of coordinate k over all observations. */
  [[nodiscard]] double highest_floor(int k) const { return rows_[ToSize(k)].floor; }
  [[nodiscard]] double lowest_ceiling(int k) const { return -rows_[ToSize(k)].negated_ceiling; }
  /** V: the largest |floor| and |ceiling| for which E_k holds. */
  [[nodiscard]] double value_limit(int k) const { return rows_[ToSize(k)].value_limit; }
  /** PairMarginUpper for pairs of observations within value_limit and the domain, in a row with columns. */
  [[nodiscard]] double pair_margin(int k) const { return rows_[ToSize(k)].pair_margin; }

  [[nodiscard]] bool uses_hull_distance() const { return uses_hull_distance_; }

 private:
  // A coordinate of the residual.
  struct Row {
    LipschitzRow distance;
    std::shared_ptr<const ObservationIndex> index =
        std::make_shared<const ObservationIndex>();     // where constant, empty:
    double floor = 0, negated_ceiling = 0;              // then these are the row's bounds
    double value_limit = 0, locations = 0, widths = 0;  // V, S, W
    double error = 0;                                   // E_k
    double pair_margin = 0;
    std::vector<double> component_errors{};  // of each column: of v_il and of L_kl r_l
  };
  struct BoundSearch;

  void EncloseAll(const QuerySet& set, const EnvelopeTail* tail, int count, ResidualBounds& bounds) const noexcept;
  template <class Rows>
  static void Measure(Row& row, const Rows& observations, std::span<const double> domain_lower,
                      std::span<const double> domain_upper);
  void RaiseLimit(int k, double value);

  EnvelopeOptions options_;
  std::vector<Row> rows_;
  std::vector<int> active_;                                             // the rows that are searched
  std::array<double, kMaxStates> constant_lower_{}, constant_upper_{};  // the bounds of the others
  bool uses_hull_distance_ = false;
};

}  // namespace forereach
