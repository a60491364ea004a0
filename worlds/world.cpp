#include "worlds/world.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/text.h"
#include "forereach/safety/grid_map.h"
#include "lcmtypes/printable.h"
#include "task/config_error.h"
#include "task/keep_in.h"

namespace forereach {
namespace {

std::string Numbers(const Eigen::VectorXd& y) { return fmt::format("[{}, {}]", ToText(y[0]), ToText(y[1])); }

// The rows of a map are a block, whose lines stand further in than its key.
std::string GridText(const GridMap& map, const std::string& indent) {
  std::string text = fmt::format(
      "grid:\n{0}resolution: {1}\n{0}origin: [{2}, {3}, {4}]\n{0}unknown: {5}\n{0}size: [{6}, {7}]\n{0}rows: |", indent,
      ToText(map.resolution), ToText(map.origin[0]), ToText(map.origin[1]), ToText(map.yaw),
      map.outside_is_free ? "free" : "occupied", map.width, map.height);
  for (int row = map.height; row-- > 0;) {
    text += fmt::format("\n{}  ", indent);
    for (int column = 0; column < map.width; ++column) text += map.IsOccupied(column, row) ? '#' : '.';
  }
  return text;
}

std::string ShapeText(const Obstacle& obstacle, const std::string& indent) {
  const std::vector<Eigen::VectorXd>& points = obstacle.points();
  switch (obstacle.kind()) {
    case Obstacle::Kind::kCircle:
      return fmt::format("circle: {{center: {}, radius: {}}}", Numbers(points[0]), ToText(obstacle.radius()));
    case Obstacle::Kind::kBox:
      return fmt::format("box: {{lower: {}, upper: {}}}", Numbers(points[0]), Numbers(points[1]));
    case Obstacle::Kind::kHalfSpace:
      return fmt::format("half_plane: {{normal: {}, offset: {}}}", Numbers(points[0]), ToText(obstacle.offset()));
    case Obstacle::Kind::kGrid: return GridText(MapOf(obstacle), indent + "      ");
    case Obstacle::Kind::kPolygon: break;
  }
  std::string vertices;
  for (const Eigen::VectorXd& point : points) vertices += (vertices.empty() ? "" : ", ") + Numbers(point);
  return fmt::format("polygon: {{vertices: [{}]}}", vertices);
}

std::string NotesText(const World& world, const std::string& origin, const std::string& indent) {
  std::string text = fmt::format("{}# The obstacles of {}, by forereach import-world.\n", indent, Printable(origin));
  for (const std::string& note : world.notes) text += fmt::format("{}# {}\n", indent, Printable(note));
  return text;
}

std::string ListText(const World& world, const std::string& indent) {
  if (world.pieces.empty()) return fmt::format("{}obstacles: []\n", indent);
  std::string text = indent + "obstacles:\n";
  for (const auto& [name, obstacle, window] : world.pieces) {
    text += fmt::format("{}  - {}", indent, ShapeText(obstacle, indent));
    text += obstacle.grid() || name.empty() ? "\n" : fmt::format("  # {}\n", Printable(name));
    if (!obstacle.name().empty()) text += fmt::format("{}    name: {}\n", indent, obstacle.name());
    if (window)
      text += fmt::format("{}    motion: {{velocity: [0, 0], from: {}, until: {}}}\n", indent,
                          ToText(window->from + 0.0), ToText(window->until + 0.0));  // no -0
  }
  return text;
}

// Beyond the lower and the upper end of x, then of y.
using Sides = std::array<bool, 4>;

// Behind which sides of the box all of an obstacle lies.
Sides SidesBeyond(const Obstacle& obstacle, const Box& region) {
  Sides is_beyond{};
  for (int k = 0; k < 2; ++k) {
    const auto at = static_cast<std::size_t>(2 * k);
    if (obstacle.kind() == Obstacle::Kind::kHalfSpace) {
      const Eigen::VectorXd& normal = obstacle.points()[0];
      if (normal[1 - k] != 0) continue;
      is_beyond[at] = normal[k] == -1 && -obstacle.offset() < region.lower()[k];
      is_beyond[at + 1] = normal[k] == 1 && obstacle.offset() > region.upper()[k];
    } else {
      is_beyond[at] = AddUp(obstacle.upper()[k], obstacle.radius()) < region.lower()[k];
      is_beyond[at + 1] = SubDown(obstacle.lower()[k], obstacle.radius()) > region.upper()[k];
    }
  }
  return is_beyond;
}

}  // namespace

std::string ObstacleName(std::string_view text) {
  const auto is_letter = [](char c) { return WhyNoName({&c, 1}).empty(); };
  std::string name;
  if (!text.empty() && '0' <= text.front() && text.front() <= '9') return name;
  for (const char c : text.substr(0, text.find(','))) {
    if (name.size() == kMaxObstacleName) break;
    if (name.empty() && !is_letter(c)) continue;
    name += WhyNoName(std::string{'a', c}).empty() ? c : '_';
  }
  return name;
}

void World::Add(const std::string& name, const Obstacle& obstacle, std::optional<Window> window) {
  pieces.push_back({name, obstacle.Named(ObstacleName(name)), window});
}

void World::Add(const std::string& name, const std::vector<PlanePoint>& points, std::optional<Window> window) {
  const Ring hull = ConvexHull(points);
  for (std::size_t begin = 1; begin == 1 || begin + 1 < hull.size(); begin += kMaxObstaclePoints - 2) {
    Ring part{hull.front()};  // a fan from the first corner
    for (std::size_t i = begin; i < std::min<std::size_t>(hull.size(), begin + kMaxObstaclePoints - 1); ++i)
      part.push_back(hull[i]);
    Add(name, ToObstacle(part), window);
  }
}

void World::AddBeyond(int axis, int sign, double at, const std::string& name) {
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();
  normal[axis] = sign;
  Add(name, Obstacle::HalfSpace(normal, sign * at));
}

World Cropped(World world, const Box& region) {
  Sides is_cut{};
  const auto is_dropped = [&](const World::Piece& piece) {
    const Sides is_beyond = SidesBeyond(piece.obstacle, region);
    const auto side = std::ranges::find(is_beyond, true);
    if (side == is_beyond.end()) return false;
    bool is_behind_a_cut = false;
    for (std::size_t i = 0; i < 4; ++i) is_behind_a_cut |= is_beyond[i] && is_cut[i];
    // One half-plane stands for all that lies beyond that side.
    if (!is_behind_a_cut) is_cut[static_cast<std::size_t>(side - is_beyond.begin())] = true;
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
  return NotesText(world, origin, "") + "task:\n" + ListText(world, "  ");
}

std::string WithObstacles(const std::string& task, const World& world, const std::string& origin,
                          const std::string& path) {
  constexpr std::string_view kLine = "obstacles: []";
  const std::size_t at = task.find(kLine), begin = task.rfind('\n', at) + 1;
  const bool is_line = at != std::string::npos && task.find_first_not_of(' ', begin) == at;
  if (!is_line || task.find(kLine, at + 1) != std::string::npos)
    throw ConfigError("{}: has to have one line `obstacles: []` in `task`, which is replaced", path);
  const std::string indent(at - begin, ' ');
  const std::size_t end = std::min(task.find('\n', at), task.size() - 1) + 1;
  return task.substr(0, begin) + NotesText(world, origin, indent) + ListText(world, indent) + task.substr(end);
}

}  // namespace forereach
