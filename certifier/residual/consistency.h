/** The pairwise consistency test, Proposition 1. */
#pragma once

#include <optional>

#include "certifier/residual/declaration.h"
#include "certifier/residual/observations.h"

namespace forereach {

/** Observations i and j contradict the declaration in coordinate k:
    |r~_ik - r~_jk| >= difference > bound >= sum_l L_kl |z_il - z_jl| + 2 sigma_k. */
struct Violation {
  int first, second, coordinate;
  double difference, bound;
};

/** The test of one pair, rounded in favour of the declaration: a violation is one in real arithmetic. */
[[nodiscard]] std::optional<Violation> TestPair(const Declaration& declaration, const Observations& observations, int first,
                                                int second, int coordinate);

/** A provable violation of Eq. (falsification), in the lowest coordinate k that has one: its first pair in the order
i < j, or its worst where row k of L is zero. None if no pair provably violates it: rounding alone never falsifies a
declaration. Plain arithmetic over an ObservationIndex finds suspects, TestPair decides. Cost, for each row with columns,
that of the index, then about N steps down its tree: 10^6 observations in a fraction of a second. Pairs that meet the
declaration's bound to within some units in the last place are all tested. */
[[nodiscard]] std::optional<Violation> FindViolation(const Declaration& declaration, const Observations& observations);

}  // namespace forereach
