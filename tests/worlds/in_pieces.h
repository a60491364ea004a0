/** Exact judges of the pieces of a world. */
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "tests/oracle/exact.h"
#include "worlds/world.h"

namespace forereach {

using ExactPoint = std::pair<Rational, Rational>;

[[nodiscard]] inline Rational Cross(const ExactPoint& a, const ExactPoint& b, const ExactPoint& c) {
  return (b.first - a.first) * (c.second - a.second) - (b.second - a.second) * (c.first - a.first);
}

[[nodiscard]] inline ExactPoint ToExact(const PlanePoint& p) { return {Rational(p.x), Rational(p.y)}; }

/** Whether a counter-clockwise convex ring, with its boundary, has the point. */
[[nodiscard]] inline bool Has(const Ring& convex, const ExactPoint& p) {
  for (std::size_t i = 0; i < convex.size(); ++i)
    if (Cross(ToExact(convex[i]), ToExact(convex[(i + 1) % convex.size()]), p) < 0) return false;
  return true;
}

/** Whether a point lies inside a ring, by the parity of the sides right of it; none may go through the point. */
[[nodiscard]] inline bool IsEnclosed(const Ring& ring, const ExactPoint& p) {
  bool inside = false;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const ExactPoint a = ToExact(ring[i]), b = ToExact(ring[(i + 1) % ring.size()]);
    if ((a.second > p.second) != (b.second > p.second) && (Cross(a, b, p) > 0) == (b.second > a.second))
      inside = !inside;
  }
  return inside;
}

/** The corners of a box or polygon. */
[[nodiscard]] inline Ring CornersOf(const Obstacle& obstacle) {
  std::vector<PlanePoint> points;
  for (const Eigen::Vector3d& corner : obstacle.hull()) points.push_back({corner.x(), corner.y()});
  return ConvexHull(points);
}

/** Whether an obstacle contains a point, moved by nothing. */
[[nodiscard]] inline bool Contains(const Obstacle& obstacle, const ExactPoint& p) {
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace)
    return Rational(obstacle.points()[0][0]) * p.first + Rational(obstacle.points()[0][1]) * p.second >=
           Rational(obstacle.offset());
  if (obstacle.kind() == Obstacle::Kind::kCircle) {
    const Rational x = p.first - Rational(obstacle.points()[0][0]), y = p.second - Rational(obstacle.points()[0][1]);
    return x * x + y * y <= Rational(obstacle.radius()) * Rational(obstacle.radius());
  }
  const Ring hull = CornersOf(obstacle);
  if (hull.size() > 2) return Has(hull, p);
  const ExactPoint a = ToExact(hull.front()), b = ToExact(hull.back());
  return Cross(a, b, p) == 0 && std::min(a.first, b.first) <= p.first && p.first <= std::max(a.first, b.first) &&
         std::min(a.second, b.second) <= p.second && p.second <= std::max(a.second, b.second);
}

/** Whether a world has the point at this time, in seconds. */
[[nodiscard]] inline bool Contains(const World& world, const ExactPoint& p, double time = 0) {
  return std::ranges::any_of(world.pieces, [&](const World::Piece& piece) {
    return (!piece.window || (piece.window->from <= time && time <= piece.window->until)) &&
           Contains(piece.obstacle, p);
  });
}

}  // namespace forereach
