/** The pairwise consistency test, Proposition 1, Eq. (falsification). */
#pragma once

#include <optional>

#include "forereach/residual/declaration.h"
#include "forereach/residual/observations.h"

namespace forereach {

class LipschitzEnvelope;

/** A proof that observations i = first and j = second contradict the declaration in coordinate k:
    |r~_ik - r~_jk| >= difference > bound >= sum_l L_kl |z_il - z_jl| + 2 (sigma_k + w^_k).
Each observation has its own error and its own disturbance, so both count twice. With second = -1 it is a proof that
transition i alone contradicts a declared bound on a rate of state k (certify/rates.h), with -2 - j that it contradicts
that of region j: |r_k(z_i)| >= difference > bound. */
struct Violation {
  int first, second, coordinate;
  double difference, bound;

  [[nodiscard]] static constexpr int OfRegion(int j) { return -2 - j; }
  /** j, or negative; of `second`. */
  [[nodiscard]] static constexpr int RegionOf(int second) { return -2 - second; }
};

/** Places z, z' with sum_l |z_l - z'_l| / s_l below this are near each other, where the s_l are the standard
deviations: residuals that differ there scatter. */
inline constexpr double kNearby = 0.1;

/** Tests one pair in one coordinate. Rounding favours the declaration, so a returned violation holds in real
arithmetic. Cost O(d_z). */
[[nodiscard]] std::optional<Violation> TestPair(const Declaration& declaration, const Observations& observations,
                                                int first, int second, int coordinate);

/** Searches all pairs for a provable violation of Eq. (falsification). Returns one in the lowest coordinate k that has
any: the first pair in the order i < j, or the pair of largest difference if row k of L is zero. Returns none if no pair
provably violates the inequality, so rounding alone never falsifies a declaration. Plain arithmetic over an
ObservationIndex finds suspects, and TestPair decides. Cost for each row of L with nonzero columns: construction of the
index, then about N descents of its tree; 10^6 observations take a fraction of a second. Every pair within some units in
the last place of its bound is tested exactly. Rows at one location, as of a robot that stands, count as their two
extremes there, so only many such pairs between different locations cost more.
@param envelope of these observations under this declaration, or null. Its indexes are used, and none is built. */
[[nodiscard]] std::optional<Violation> FindViolation(const Declaration& declaration, const Observations& observations,
                                                     const LipschitzEnvelope* envelope = nullptr);

}  // namespace forereach
