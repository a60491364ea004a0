/** How far a point of a box can be from the nearest of some points. */
#pragma once

#include <span>

#include <Eigen/Core>

#include "forereach/numerics/interval.h"

namespace forereach::research {

/** An upper bound, rounded outward, on  sup_{z in box} min_i sum_l weight_l |z_l - z_il|, the covering radius of the
points in the box. Found by cutting boxes in two, the worst first, until it is within `slack` of a value taken at a
point, relatively, or `max_boxes` boxes are there; any bound on the way holds.
@param points N-by-d, N >= 1. @param weights d entries, not negative and finite. Cost O(max_boxes N d). */
[[nodiscard]] double CoveringRadiusUpper(std::span<const Interval> box, const Eigen::MatrixXd& points,
                                         const Eigen::VectorXd& weights, double slack = 0.01, int max_boxes = 4096);

}  // namespace forereach::research
