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

/** A provable violation of Eq. (falsification), in the lowest coordinate k that has one: its first pair in the order
i < j, or its worst where row k of L is zero. None if no pair provably violates it. Proof is in real arithmetic, so rounding alone never falsifies a declaration. Cost O(N^2) for each row of L with a
nonzero entry, O(N) for the others. */
[[nodiscard]] std::optional<Violation> FindViolation(const Declaration& declaration, const Observations& observations);

}  // namespace forereach
