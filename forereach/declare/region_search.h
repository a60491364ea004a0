/** Regions (declaration.h) that pay, proven from a residual's equations.

A grid of cells is chosen by the mean of their slopes over the domain's volume, each slope L_kl relative to that of the
whole domain: first the best of the grids of even strips, a power of two along each axis; then cuts that save nothing
give way to cuts in the middle of strips that save most for each cell that they add.
Every slope of every cell is bounded by BoundSlope over the cell and all parameters. */
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "forereach/declare/slope_bound.h"
#include "forereach/residual/declaration.h"

namespace forereach {

struct RegionSearchOptions {
  std::size_t most_cells = 64;  ///< At most Region::kMaxCells.
  SlopeBoundOptions slopes = {.gap = 1e-3, .max_boxes = 100'000};
  double least_gain = 1e-3;  ///< Of the mean: a cut that lowers it by less does not pay.
};

/** The cells of the grid that was found; neighbours along the first axis with the same slopes are one region.
@param lipschitz finite bounds on the slopes over the whole domain: no region has larger ones.
@param variables the axes: at most Region::kMaxVariables, none of them in an inequality or ball. */
[[nodiscard]] std::vector<Region> FindRegions(const ResidualSlopes& slopes, const Domain& domain,
                                              std::span<const Interval> parameters, const Eigen::MatrixXd& lipschitz,
                                              const std::vector<int>& variables,
                                              const RegionSearchOptions& options = {});

/** The part of a domain that lies in a region; none if that is empty. */
[[nodiscard]] std::optional<Domain> PartIn(const Domain& domain, const Region& region);

}  // namespace forereach
