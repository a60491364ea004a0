/** Areas that a robot has to stay in. What counts is all outside of them, as obstacles. */
#pragma once

#include <string>
#include <vector>

#include "forereach/safety/obstacle.h"
#include "task/plane.h"

namespace forereach {

struct KeepIn {
  std::string name;
  Area area;
};

/** The most corners of areas to stay in: those of a frame around them are added. */
inline constexpr int kMaxKeepInCorners = kMaxAreaCorners - 4;

/** A convex polygon; an axis-aligned box if it is one. A point or a segment is a polygon that repeats its last corner.
@pre hull is ConvexHull's, of at most kMaxObstaclePoints corners. */
[[nodiscard]] Obstacle ToObstacle(const Ring& hull);

/** Obstacles whose union is exactly what lies outside of all of the areas, with their boundaries; then each is grown by
the margin, outward. They are the four half-planes beyond the box around the areas, the holes, and what lies between box
and areas, in convex pieces; pieces may stick out of the box by a thousandth of its size, into the half-planes.
Cost: that of ConvexPieces. @pre margin >= 0, areas is not empty.
@throws NoPolygon if one is no area, two of them meet, or they have more corners than kMaxKeepInCorners. */
[[nodiscard]] std::vector<Obstacle> OutsideOf(const std::vector<Area>& areas, double margin = 0);

}  // namespace forereach
