/** The choice of observations to keep when there are too many.

Observation j attains the envelope somewhere if and only if, in some coordinate k, it gives the tightest bound at its
own location: v_j > max_{i != j} v_i - d_k(z_i, z_j) for the floor, and likewise for the ceiling. If another observation
gives an equally tight bound at z_j, it does so everywhere, by the triangle inequality. Of observations with equal
bounds the first one counts. So one query for each observation, coordinate and side decides. The excess v_j - max(...)
is the observation's gain. */
#pragma once

#include <cstddef>
#include <vector>

#include "forereach/residual/declaration.h"
#include "forereach/residual/observations.h"

namespace forereach {

/** The indices, ascending, of at most `most` observations. If at most `most` observations attain the envelope, it
returns all of these and the envelope does not change. Otherwise it removes those of least gain first, measured in units
of the range of r~_k, in rounds; no observation is removed because of another that is removed in the same round. It uses
plain arithmetic, since every choice gives a sound envelope. Cost: about 2 n N envelope queries for each round. @pre
most >= 1. */
[[nodiscard]] std::vector<int> MostUseful(const Declaration& declaration, const Observations& observations,
                                          std::size_t most);

/** The observations of `indices`, in that order. */
[[nodiscard]] Observations Select(const Observations& observations, const std::vector<int>& indices);

}  // namespace forereach
