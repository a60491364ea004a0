/** Points and polygons of the plane. What compares is exact on doubles; what is computed covers, rounded outward. */
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace forereach {

/** In metres. */
struct PlanePoint {
  double x = 0, y = 0;

  friend bool operator==(const PlanePoint&, const PlanePoint&) = default;
  /** By x, then by y. */
  friend bool operator<(const PlanePoint& a, const PlanePoint& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }
};

/** The corners of a closed chain of segments, the last joined with the first. */
using Ring = std::vector<PlanePoint>;

/** The sign of the exact determinant of (b - a, c - a): 1 if c lies left of the line from a to b, -1 right of it, 0 on
it.
@pre finite. */
[[nodiscard]] int Turn(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c);

/** The corners of the convex hull, counter-clockwise, none of them on a line between its neighbours. One or two points
if the hull is a point or a segment. Exact. Cost O(n log n). */
[[nodiscard]] Ring ConvexHull(std::vector<PlanePoint> points);

/** A convex polygon that contains conv(points) + [-margin, margin]^2, and with it all points within `margin` of
conv(points): corners are rounded outward. It has at most four corners more than conv(points).
@pre margin >= 0. */
[[nodiscard]] Ring Grown(const std::vector<PlanePoint>& points, double margin);

/** Where a polygon is none. */
class NoPolygon : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/** {points inside `outer` and outside of every hole, with all boundaries}. */
struct Area {
  Ring outer;
  std::vector<Ring> holes;
};

/** The most corners of an area, with its holes. */
inline constexpr int kMaxAreaCorners = 4096;

/** Convex polygons whose union is exactly the area, and whose insides are disjoint. Their corners are corners of the
area, counter-clockwise, at most `most_corners` each. A triangulation by ear clipping, whose triangles are then joined
while they stay convex. Rings may have either direction and repeat a corner at once, as their first one at the end.
Proof that no ear can be wrong: a clipped triangle takes from the closed chain exactly its own boundary. All triangles
turn left, so the sum of their indicators is the chain's winding number, which is 1 inside and 0 outside.
Cost: of O(n) ears, each in O(n) to O(n^2).
@pre finite, most_corners >= 3.
@throws NoPolygon with the place if a ring has no area, two sides meet or touch, a hole is not inside, or there are more
corners than kMaxAreaCorners. */
[[nodiscard]] std::vector<Ring> ConvexPieces(const Area& area, int most_corners);

/** Whether two closed segments have a point in common. Exact. */
[[nodiscard]] bool Meet(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c, const PlanePoint& d);

/** Of SharesOutside: so many places where a ring cuts the segment count, with its two ends. */
inline constexpr std::size_t kMostCuts = 100;

/** The parts of the segment from a to b that lie strictly inside no ring (a point is inside if a ray from it meets the
ring an odd number of times), but for single points, as shares of it from 0 to 1, ascending. Decided exactly; each part
is rounded outward. A ring that cuts the segment at more places than kMostCuts counts as if it were not there.
@pre a != b. */
[[nodiscard]] std::vector<std::pair<double, double>> SharesOutside(const PlanePoint& a, const PlanePoint& b,
                                                                   const std::vector<const Ring*>& rings);

/** "(1.5, 2)" */
[[nodiscard]] std::string ToText(const PlanePoint& point);

}  // namespace forereach
