/** The paper's own certified declarations, by its own fixed grids: on each cell every factor of a derivative is
replaced by its largest value there. In plain double arithmetic, so figures to compare with, not bounds to rely on;
those are `forereach declare`'s, and lie a little below. */
#pragma once

#include "forereach/dynamics/models/residuals.h"

namespace forereach::research {

/** The four different entries of the point mass's matrix, Eq. (pointmass-certified-matrix). */
struct PointMassGrid {
  double position_diagonal, position_cross, velocity_diagonal, velocity_cross;
};

/** Maxima of Eq. (pointmass-angle-maxima) over radial cells of 0 <= |v| <= largest_speed. */
[[nodiscard]] PointMassGrid PaperPointMassGrid(const VelocityKnee& residual, double largest_speed = 5.4,
                                               int cells = 20000);

/** The two entries of the bicycle's. */
struct BicycleGrid {
  double by_speed, by_steering;
};

/** Maxima of Eq. (bicycle-certified-partials) over cells of [0, largest_speed] x [0, largest_steering]. Cost: an
exponential for every cell, some seconds.
@param low, high each parameter of the residual lies between its two: each factor is at its worst parameters by itself,
as it is at its worst point of a cell. @pre no parameter of `low` exceeds that of `high`, all are positive */
[[nodiscard]] BicycleGrid PaperBicycleGrid(const HeadingSaturation& low, const HeadingSaturation& high,
                                           double largest_speed = 25, double largest_steering = 0.48,
                                           int speed_cells = 16000, int steering_cells = 8000);

/** Of one residual. */
[[nodiscard]] inline BicycleGrid PaperBicycleGrid(const HeadingSaturation& residual) {
  return PaperBicycleGrid(residual, residual);
}

}  // namespace forereach::research
