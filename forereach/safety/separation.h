/** Proofs that a projected slice, or what a body sweeps, is disjoint from an obstacle, by a dual bound. For every
direction d and every set Y,

    min {d . w : w in core} - max {d . y : y in Y} <= |d|_2 * distance(core, Y),

and the maximum over the convex hull of several sets is the largest of their maxima.

The search for a good d runs in plain arithmetic and may fail. The left side is then evaluated with outward rounding, so
the reported distance is valid for every d. The paper's test R_t < m_t, Eq. (safety-radius-margin), is a special
case. */
#pragma once

#include <array>
#include <span>

#include "forereach/numerics/instruction_set.h"
#include "forereach/safety/obstacle.h"

namespace forereach {

class Zonotope;

struct Separation {
  /** A lower bound on the distance from the set to the core, in metres. Not positive if no distance was proven. */
  double distance = -kInfinity;
  /** The distance to be kept, in metres: the obstacle's radius and what is added to it. The set is disjoint from the
  obstacle if distance > threshold. */
  double threshold = 0;

  [[nodiscard]] bool IsProven() const { return distance > threshold; }
  /** A lower bound on the distance from slice to obstacle, in metres. Not positive if no separation was proven. */
  [[nodiscard]] double clearance() const { return SubDown(distance, threshold); }
};

/** The interval hull of a projected slice: center +- half_width in each of p coordinates, in metres. */
struct Hull {
  std::array<double, kMaxSafetyDim> center, half_width;
};

/** A hull that contains both, in the first `dim` coordinates. */
[[nodiscard]] Hull Join(const Hull& a, const Hull& b, int dim) noexcept;

/** One of the sets whose convex hull is separated from an obstacle: {y - v : y in set, v in shift} + {y : |y|_2 <=
ball}. The shift is that of the obstacle, since its motion is seen from the obstacle. */
struct Piece {
  const Zonotope* set = nullptr;
  double ball = 0;                              ///< Metres, not negative.
  std::array<Interval, kMaxSafetyDim> shift{};  ///< Metres.
};
inline constexpr int kMaxPieces = 2 * kMaxBodyPoints;  ///< The points of a body at two samples.

/** Separates the interval hulls of slice and core; for a half-space it uses the normal. Sound but not tight. Cost
O(p). @param added is added to the obstacle's radius as the threshold, metres, not negative. */
[[nodiscard]] Separation SeparateHulls(const Hull& slice, const Obstacle& obstacle, double added = 0) noexcept;

/** The dual bound of one direction d: a lower bound on the distance from any set Y to the core, in metres; -infinity if
it is not positive. Cost O(1) for each point of the core.
@param support an upper bound on max {d . y : y in Y}; NaN and infinity prove nothing. @param d its unused entries are 0
and its length is between 2^-400 and 2^400; any length proves the same. For a half-space its normal. */
[[nodiscard]] double DistanceLower(const Obstacle& obstacle, const Eigen::Vector3d& d, double support) noexcept;

/** Separates slice and core by the best direction that the search finds. For p <= 2 the distance is exact up to
rounding. For p = 3 the search tries the normals of faces and of pairs of edges, and so proves every separation that
exists, up to rounding. Cost for m generators: for p <= 2, O(m) if a few directions suffice and O(m^2) if these prove
nothing; for p = 3, O(m^3).
@param instructions changes the computing time only. @pre slice.dim() == obstacle.dim() */
[[nodiscard]] Separation Separate(const Zonotope& slice, const Obstacle& obstacle,
                                  InstructionSet instructions = BestInstructionSet()) noexcept;

/** Separates the convex hull of 1 to kMaxPieces pieces and the core, likewise. The search for several pieces, or in
space with a threshold, approaches the nearest point of {core - hull}; its distance is exact up to the search's
tolerance, about 1e-7 of the distance. Cost O(m) for the generators of all pieces and each of at most some fifty
directions.
@param added what is added to the obstacle's radius as the threshold, metres, not negative.
@param enough a clearance above which the search may end, metres: what is farther is not of interest. */
[[nodiscard]] Separation Separate(std::span<const Piece> pieces, const Obstacle& obstacle, double added,
                                  InstructionSet instructions = BestInstructionSet(),
                                  double enough = kInfinity) noexcept;

}  // namespace forereach
