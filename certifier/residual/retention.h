/** Which observations to keep where there is no room for all.

Observation j attains the envelope somewhere if and only if, in some coordinate k, its floor lies above what the others
say of its own place, v_j > max_{i != j} v_i - d_k(z_i, z_j), or its ceiling below: if another one says as much at z_j,
it says as much everywhere, by the triangle inequality. Of observations that say the same, the first counts. So one
query per observation, coordinate and side decides, and its excess is what the observation gains. */
#pragma once

#include <cstddef>
#include <vector>

#include "certifier/residual/declaration.h"
#include "certifier/residual/observations.h"

namespace forereach {

/** Indices, ascending, of at most `most` observations. All that attain the envelope, if they are not more: it does not
change then. Else those of least gain go first, in units of the range of r~_k; and none goes on account of another that
goes in the same round. Plain arithmetic: a choice, no bound. Cost about that of 2 n N envelope queries a round. @pre
most >= 1. */
[[nodiscard]] std::vector<int> MostUseful(const Declaration& declaration, const Observations& observations,
                                          std::size_t most);

/** The rows of `indices`, in that order. */
[[nodiscard]] Observations Select(const Observations& observations, const std::vector<int>& indices);

}  // namespace forereach
