#include "task/keep_in.h"

#include <algorithm>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/limits.h"

namespace forereach {
namespace {

Eigen::Vector2d ToVector(const PlanePoint& p) { return {p.x, p.y}; }

struct Corners {
  PlanePoint lower, upper;
};

Corners CornersAround(const Ring& ring) {
  Corners box{ring.front(), ring.front()};
  for (const auto& [x, y] : ring) {
    box.lower = {std::min(box.lower.x, x), std::min(box.lower.y, y)};
    box.upper = {std::max(box.upper.x, x), std::max(box.upper.y, y)};
  }
  return box;
}

bool IsBeyond(const Ring& piece, const Corners& box) {
  const auto [lower, upper] = CornersAround(piece);
  return upper.x <= box.lower.x || lower.x >= box.upper.x || upper.y <= box.lower.y || lower.y >= box.upper.y;
}

// {p : sign axis . p >= sign at}, grown.
Obstacle Beyond(const Eigen::Vector2d& axis, int sign, double at, double margin) {
  return Obstacle::HalfSpace(sign * axis, sign > 0 ? SubDown(at, margin) : -AddUp(at, margin));
}

}  // namespace

Obstacle ToObstacle(const Ring& hull) {
  const auto [lower, upper] = CornersAround(hull);
  const bool is_box = std::ranges::all_of(hull, [&lower = lower, &upper = upper](const PlanePoint& p) {
    return (p.x == lower.x || p.x == upper.x) && (p.y == lower.y || p.y == upper.y);
  });
  // A diagonal has its corners at those of a box, too.
  if (is_box && (hull.size() == 4 || lower.x == upper.x || lower.y == upper.y))
    return Obstacle::AxisBox(ToVector(lower), ToVector(upper));
  std::vector<Eigen::VectorXd> vertices;
  for (const PlanePoint& p : hull) vertices.emplace_back(ToVector(p));
  while (vertices.size() < 3) vertices.push_back(vertices.back());
  return Obstacle::Polygon(vertices);
}

std::vector<Obstacle> OutsideOf(const std::vector<Area>& areas, double margin) {
  const int most = margin > 0 ? kMaxObstaclePoints - 4 : kMaxObstaclePoints;  // a grown piece may have four more
  std::vector<Obstacle> outside;
  Area between;  // a frame and the areas
  Ring all;
  for (const Area& area : areas) {
    static_cast<void>(ConvexPieces(area, most));  // it has to be one
    for (const Ring& hole : area.holes)
      for (const Ring& piece : ConvexPieces({hole, {}}, most)) outside.push_back(ToObstacle(Grown(piece, margin)));
    between.holes.push_back(area.outer);
    all.insert(all.end(), area.outer.begin(), area.outer.end());
  }
  const Corners box = CornersAround(all);
  // A frame around all areas. Only what lies between them is kept of it; beyond it four half-planes stand for
  // everything.
  const double thick = std::max(box.upper.x - box.lower.x, box.upper.y - box.lower.y) / 1024;
  const auto below = [&](double at) { return std::min(at - thick, NextDown(at)); };
  const auto above = [&](double at) { return std::max(at + thick, NextUp(at)); };
  const PlanePoint lower{below(box.lower.x), below(box.lower.y)}, upper{above(box.upper.x), above(box.upper.y)};
  between.outer = {lower, {upper.x, lower.y}, upper, {lower.x, upper.y}};
  for (const Ring& piece : ConvexPieces(between, most))
    if (!IsBeyond(piece, box)) outside.push_back(ToObstacle(Grown(piece, margin)));
  const Eigen::Vector2d x(1, 0), y(0, 1);
  outside.push_back(Beyond(x, -1, box.lower.x, margin));
  outside.push_back(Beyond(x, 1, box.upper.x, margin));
  outside.push_back(Beyond(y, -1, box.lower.y, margin));
  outside.push_back(Beyond(y, 1, box.upper.y, margin));
  return outside;
}

}  // namespace forereach
