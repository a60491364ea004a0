/** Scenarios of CommonRoad, version 2020a or 2018b: the road's boundary, what stands on it, and what moves on it. */
#pragma once

#include <string>

#include "worlds/world.h"

namespace forereach {

struct CommonRoadOptions {
  /** Consecutive segments of a boundary are one convex piece while none of its points is farther than this from the
  chord, m. 0: only those on one line. */
  double thickness = 0.05;
  /** A window covers so many time steps. More make fewer and larger pieces. */
  int steps_per_window = 1;
  /** So near to a neighbour's bound a lanelet's own is none, m: files round, and sample both bounds differently. */
  static constexpr double kBeside = 0.1;
};

/** The boundary is each lanelet's left bound but where it lies along its left neighbour, and its right bound likewise,
and except where it lies inside another lanelet, as in crossings; lanelets have open ends. A lanelet for walking or
cycling, or one at another height, counts as none there. So what lies between two
neighbours, as a median does, is no road, nor what is beyond the end of a neighbour. A segment is a set without width,
which certificates at all times do not let through.

An obstacle that stands is its shape, grown by what its intervals of position and orientation allow. Of one that moves,
a window [t_i, t_i+k] holds the convex hull of all its occupancies there. It contains the motion from one state to the
next if each point of the obstacle moves on a straight line, or the obstacle turns evenly about a center that does:
shapes are grown by what a corner's arc then leaves its chord. Before its first and after its last state nothing is
known of an obstacle, and nothing is said: no window covers that time; a note names the last. Circles are octagons
around them where they move.
@throws ConfigError with file and line: another version, a state without position or time, a shape that is none. */
[[nodiscard]] World ReadCommonRoad(const std::string& path, const CommonRoadOptions& options);

}  // namespace forereach
