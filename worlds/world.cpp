#include "worlds/world.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "forereach/numerics/limits.h"
#include "forereach/numerics/text.h"
#include "lcmtypes/printable.h"

namespace forereach {
namespace {

Eigen::Vector2d ToVector(const PlanePoint& p) { return {p.x, p.y}; }

// A convex polygon; an axis-aligned box if it is one. A point or a segment is a polygon that repeats its last corner.
Obstacle ToObstacle(const Ring& hull) {
  PlanePoint lower = hull.front(), upper = hull.front();
  for (const auto& [x, y] : hull) {
    lower = {std::min(lower.x, x), std::min(lower.y, y)};
    upper = {std::max(upper.x, x), std::max(upper.y, y)};
  }
  const bool is_box = std::ranges::all_of(hull, [&](const PlanePoint& p) {
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

std::string Numbers(const Eigen::VectorXd& y) { return fmt::format("[{}, {}]", ToText(y[0]), ToText(y[1])); }

std::string ShapeText(const Obstacle& obstacle) {
  const std::vector<Eigen::VectorXd>& points = obstacle.points();
  switch (obstacle.kind()) {
    case Obstacle::Kind::kCircle:
      return fmt::format("circle: {{center: {}, radius: {}}}", Numbers(points[0]), ToText(obstacle.radius()));
    case Obstacle::Kind::kBox:
      return fmt::format("box: {{lower: {}, upper: {}}}", Numbers(points[0]), Numbers(points[1]));
    case Obstacle::Kind::kHalfSpace:
      return fmt::format("half_plane: {{normal: {}, offset: {}}}", Numbers(points[0]), ToText(obstacle.offset()));
    case Obstacle::Kind::kPolygon: break;
  }
  std::string vertices;
  for (const Eigen::VectorXd& point : points) vertices += (vertices.empty() ? "" : ", ") + Numbers(point);
  return "polygon: {vertices: [" + vertices + "]}";
}

}  // namespace

void World::Add(const std::string& name, const std::vector<PlanePoint>& points, std::optional<Window> window) {
  const Ring hull = ConvexHull(points);
  for (std::size_t begin = 1; begin == 1 || begin + 1 < hull.size(); begin += kMaxObstaclePoints - 2) {
    Ring part{hull.front()};  // a fan from the first corner
    for (std::size_t i = begin; i < std::min<std::size_t>(hull.size(), begin + kMaxObstaclePoints - 1); ++i)
      part.push_back(hull[i]);
    pieces.push_back({name, ToObstacle(part), window});
  }
}

void World::AddBeyond(int axis, int sign, double at, const std::string& name) {
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();
  normal[axis] = sign;
  pieces.push_back({name, Obstacle::HalfSpace(normal, sign * at), {}});
}

World Cropped(World world, const Box& region) {
  std::array<bool, 4> is_cut{};  // beyond the lower and the upper end of x, then of y
  const auto is_dropped = [&](const World::Piece& piece) {
    const Obstacle& obstacle = piece.obstacle;
    if (obstacle.kind() == Obstacle::Kind::kHalfSpace) return false;
    std::array<bool, 4> is_beyond{};
    for (int k = 0; k < 2; ++k) {
      const auto at = static_cast<std::size_t>(2 * k);
      is_beyond[at] = AddUp(obstacle.upper()[k], obstacle.radius()) < region.lower()[k];
      is_beyond[at + 1] = SubDown(obstacle.lower()[k], obstacle.radius()) > region.upper()[k];
    }
    const auto side = std::ranges::find(is_beyond, true);
    if (side == is_beyond.end()) return false;
    const auto is_behind_a_cut = [&] {
      for (std::size_t i = 0; i < 4; ++i)
        if (is_beyond[i] && is_cut[i]) return true;
      return false;
    };
    if (!is_behind_a_cut()) is_cut[static_cast<std::size_t>(side - is_beyond.begin())] = true;
    return true;
  };
  std::erase_if(world.pieces, is_dropped);
  for (int k = 0; k < 2; ++k) {
    if (is_cut[static_cast<std::size_t>(2 * k)]) world.AddBeyond(k, -1, region.lower()[k], "outside of the region");
    if (is_cut[static_cast<std::size_t>(2 * k + 1)]) world.AddBeyond(k, 1, region.upper()[k], "outside of the region");
  }
  return world;
}

std::string ObstaclesText(const World& world, const std::string& origin) {
  std::string text = "# The obstacles of " + Printable(origin) + ", by forereach import-world.\n";
  for (const std::string& note : world.notes) text += "# " + Printable(note) + "\n";
  text += "task:\n  obstacles:";
  if (world.pieces.empty()) text += " []\n";
  if (!world.pieces.empty()) text += "\n";
  for (const auto& [name, obstacle, window] : world.pieces) {
    text += fmt::format("    - {}  # {}\n", ShapeText(obstacle), Printable(name));
    if (window)
      text += fmt::format("      motion: {{velocity: [0, 0], from: {}, until: {}}}\n", ToText(window->from),
                          ToText(window->until));
  }
  return text;
}

}  // namespace forereach
