/** Whether a projected slice is proven disjoint from an obstacle, by a dual bound: for any direction d,

    min {d . w : w in core} - max {d . y : y in slice} <= |d|_2 * distance(core, slice).

The search for a good d runs in plain arithmetic and may fail; the left side is then evaluated with outward rounding, so
what is reported holds for whatever d was found. */
#pragma once

#include <array>

#include "certifier/safety/obstacle.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

struct Separation {
  /** A lower bound on the distance from slice to core. Not positive where none was proven. */
  double distance = -kInfinity;
  /** What the distance has to exceed: the obstacle's radius. */
  double threshold = 0;

  [[nodiscard]] bool IsProven() const { return distance > threshold; }
  /** A lower bound on the distance from slice to obstacle; not positive where none was proven. */
  [[nodiscard]] double clearance() const { return SubDown(distance, threshold); }
};

/** The hull of a projected slice: center +- half_width in each of p coordinates. */
struct Hull {
  std::array<double, kMaxSafetyDim> center, half_width;
};

/** By the interval hulls of slice and core, for a half-space by its normal. Sound, O(p), and loose. */
[[nodiscard]] Separation SeparateHulls(const Hull& slice, const Obstacle& obstacle) noexcept;

/** By the best direction. In the plane and on the line its distance is exact up to rounding; in three dimensions it
proves every separation that exists, up to rounding, by the normals of faces and pairs of edges. Cost O(m) for the few
directions that a planar search takes, O(m^2) where that proves nothing, O(m^3) in space.
@pre slice.dim() == obstacle.dim() */
[[nodiscard]] Separation Separate(const Zonotope& slice, const Obstacle& obstacle) noexcept;

}  // namespace forereach
