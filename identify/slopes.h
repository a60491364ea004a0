/** Estimates of a Lipschitz bound from the data alone, usable as declarations and never proofs: what no pair of
observations shows, none of them can know.

All work on slopes of pairs in the distance of the declaration given, d_k(z, z') = sum_l L_kl |z_l - z'_l|, so an
estimate for coordinate k is the factor by which row k of L is multiplied: 1 means "as declared". Pairs at distance zero
do not count; a zero row stays zero. */
#pragma once

#include <cstdint>
#include <vector>

#include "forereach/residual/declaration.h"
#include "forereach/residual/observations.h"

namespace forereach {

enum class SlopeEstimator {
  /** max_ij (|r~_ik - r~_jk| - 2 sigma_k) / d_k, at least 0: Calliess et al. 2020 (LACKI), Eq. (7), lambda = 2
  sigma. */
  kLacki,
  /** 1.5 max_ij |r~_ik - r~_jk| / d_k: Strongin's estimate times a reliability factor above 1 (Strongin & Sergeyev
  2000). The factor is ours; his smallest constant for a flat function is left out. */
  kStrongin,
  /** The right end of a generalised extreme-value law fitted to maxima of slopes over random pairs, as Knuth & Chou
  (2021) take it after Weng et al. 2018: 50 maxima over 100 pairs each, fitted by probability-weighted moments
  (Hosking, Wallis & Wood 1985). Where the fit has no end, the largest maximum plus three standard deviations. Never
  less than the largest maximum. */
  kKnuthChou
};

/** The factor for each coordinate, n entries; 0 for a zero row. @param seed of the pairs drawn by kKnuthChou.
Cost O(N^2) for the first two. */
[[nodiscard]] std::vector<double> EstimateSlopes(SlopeEstimator estimator, const Declaration& declaration,
                                                 const Observations& observations, std::uint64_t seed);

/** The declaration with row k multiplied by the factor. Its noise bound stays. */
[[nodiscard]] Declaration EstimatedDeclaration(SlopeEstimator estimator, const Declaration& declaration,
                                               const Observations& observations, std::uint64_t seed);

/** The right end of the law of `maxima`, by the fit above. @pre at least 3 entries. */
[[nodiscard]] double ExtremeValueEnd(std::vector<double> maxima);

}  // namespace forereach
