/** Regions (declaration.h) in which observations show less disturbance than elsewhere. Nothing of them is proven.

A residual that L allows is compared with each observation: r^, the middle of what all observations leave of the
residual. What an observation is off r^ beyond sigma is enough of a disturbance at its place, so no pair contradicts
regions in which w_k is the largest of these. Cells are cut one after the other, where the mean of w over the
observations, each w_k relative to that of the whole domain, becomes least. */
#pragma once

#include <vector>

#include "forereach/residual/declaration.h"
#include "forereach/residual/observations.h"

namespace forereach {

struct CalmRegion {
  Region region;
  int observations = 0;  ///< In it.
};

struct CalmOptions {
  int most_cells = 8;        ///< At most Region::kMaxRegions.
  int fewest = 30;           ///< Observations in a cell.
  double factor = 1.5;       ///< Proposed w over what the cell's observations need.
  double least_gain = 0.01;  ///< Of the mean: a cut that lowers it by less does not pay.
};

/** Cells that cover the observations in up to Region::kMaxVariables of `variables`, a twentieth of their range to
spare, without those that need as much as the whole domain; none if nothing is to be gained.
@param declaration L, sigma and w as proposed, no regions. Cost: some 2000 times the observations for each row. */
[[nodiscard]] std::vector<CalmRegion> FindCalmRegions(const Declaration& declaration, const Observations& observations,
                                                      const std::vector<int>& variables,
                                                      const CalmOptions& options = {});

}  // namespace forereach
