#include "forereach/safety/occupancy_grid.h"

#include <cmath>
#include <utility>

#include "forereach/numerics/interval.h"
#include "forereach/numerics/require.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

void Validate(const OccupancyGrid::Map& map) {
  const auto require_within = [](const char* what, double value, double most) {
    Require(-most <= value && value <= most, std::string("grid: ") + what + " " + ToText(value) + " is outside [-" +
                                                 ToText(most) + ", " + ToText(most) + "]");
  };
  Require(0 < map.resolution && map.resolution <= 1e6,
          "grid: resolution " + ToText(map.resolution) + " is outside (0, 1e+06]");
  for (const double coordinate : map.origin) require_within("origin", coordinate, 1e9);
  require_within("yaw", map.yaw, 7);
  const std::int64_t cells = std::int64_t{map.width} * map.height;
  Require(map.width >= 1 && map.height >= 1 && cells <= OccupancyGrid::kMostCells,
          "grid: " + std::to_string(map.width) + " by " + std::to_string(map.height) + " cells, must be 1 to " +
              std::to_string(OccupancyGrid::kMostCells) + " in all");
  Require(std::ssize(map.occupied) == cells,
          "grid: " + std::to_string(map.occupied.size()) + " values of " + std::to_string(cells) + " cells");
}

// The map's frame: its axes in those of the plane, and sets in it.
class Frame final {
 public:
  explicit Frame(const OccupancyGrid::Map& map)
      : map_(map), cosine_(cos(Interval(map.yaw))), sine_(sin(Interval(map.yaw))) {
    if (map.yaw == 0) cosine_ = Interval(1), sine_ = Interval(0);
  }

  // A convex set that contains the cells. Of a map that is turned: let r be the rectangle, and its corners be moved
  // away by `margin` along both axes of the map. If each is then known within `margin`, the hull of what is known of
  // them contains r, because its support along any unit vector d is at least that of r, plus margin |d|_1, minus
  // margin.
  [[nodiscard]] Obstacle Block(const OccupancyGrid::Cells& cells) const {
    const std::array first{cells.column, cells.row}, size{cells.width, cells.height};
    std::array<double, 2> lower, upper;
    for (std::size_t k = 0; k < 2; ++k) {
      lower[k] = MulDown(map_.resolution, first[k]);
      upper[k] = MulUp(map_.resolution, first[k] + size[k]);
    }
    const auto& [x, y] = map_.origin;
    if (map_.yaw == 0)
      return Obstacle::AxisBox(Eigen::Vector2d(AddDown(x, lower[0]), AddDown(y, lower[1])),
                               Eigen::Vector2d(AddUp(x, upper[0]), AddUp(y, upper[1])));
    const double margin = 0x1p-48 * (std::abs(x) + std::abs(y) + upper[0] + upper[1]);
    std::vector<Eigen::VectorXd> corners;
    for (const auto& [is_right, is_high] : {std::pair(false, false), {true, false}, {true, true}, {false, true}}) {
      const Interval u(is_right ? AddUp(upper[0], margin) : SubDown(lower[0], margin)),
          v(is_high ? AddUp(upper[1], margin) : SubDown(lower[1], margin));
      const Interval at_x = Interval(x) + cosine_ * u - sine_ * v, at_y = Interval(y) + sine_ * u + cosine_ * v;
      corners.emplace_back(Eigen::Vector2d(at_x.Middle(), at_y.Middle()));
      const double error = AddUp(at_x.DistanceUpper(at_x.Middle()), at_y.DistanceUpper(at_y.Middle()));
      Require(error <= margin, "grid: resolution " + ToText(map_.resolution) + " is too small for a turned map");
    }
    return Obstacle::Polygon(corners);
  }

  // All beyond one side: {y : n . (y - o) >= b}, n = sign times an axis of the map. If that is turned, n is known
  // within e, the sum over both entries, as n': {n' . y >= n . o + b - e far} contains what of it has coordinates up to
  // `far`.
  [[nodiscard]] Obstacle Beyond(std::size_t axis, double sign, double far) const {
    const double end = sign < 0 ? 0 : MulDown(map_.resolution, axis == 0 ? map_.width : map_.height);
    const Interval n_x = Interval(sign) * (axis == 0 ? cosine_ : -sine_),
                   n_y = Interval(sign) * (axis == 0 ? sine_ : cosine_);
    const Eigen::Vector2d normal(n_x.Middle(), n_y.Middle());
    const double error = AddUp(n_x.DistanceUpper(normal.x()), n_y.DistanceUpper(normal.y()));
    const Interval offset = n_x * Interval(map_.origin[0]) + n_y * Interval(map_.origin[1]) + Interval(end);
    return Obstacle::HalfSpace(normal, SubDown(offset.lower, MulUp(error, far)));
  }

 private:
  const OccupancyGrid::Map& map_;
  Interval cosine_, sine_;
};

}  // namespace

const GridMap& MapOf(const Obstacle& grid) { return grid.grid()->map(); }

OccupancyGrid::OccupancyGrid(Map map) : map_(std::move(map)) {
  Validate(map_);
  FindBlocks();
  if (!map_.outside_is_free) AddOutside();
  index_ = ObstacleIndex(blocks_);
}

// The runs of a row; one that the row below has too makes the block above it higher.
void OccupancyGrid::FindBlocks() {
  std::vector<std::size_t> below, here;  // blocks that end at a row, from left to right
  for (int row = 0; row < map_.height; ++row) {
    here.clear();
    std::size_t place = 0;
    for (int column = 0; column < map_.width;) {
      const int first = column;
      while (column < map_.width && map_.IsOccupied(column, row)) ++column;
      const int width = column - first;
      if (width == 0) {
        ++column;
        continue;
      }
      while (place < below.size() && cells_[below[place]].column < first) ++place;
      if (place < below.size() && cells_[below[place]].column == first && cells_[below[place]].width == width) {
        ++cells_[below[place]].height;
        here.push_back(below[place]);
        continue;
      }
      here.push_back(cells_.size());
      cells_.push_back({first, row, width, 1});
      Require(cells_.size() <= kMostBlocks, "grid: its occupied cells make more than " + std::to_string(kMostBlocks) +
                                                " rectangles, " + std::to_string(row + 1) + " rows from below");
    }
    below.swap(here);
  }
  const Frame frame(map_);
  blocks_.reserve(cells_.size());
  for (const Cells& cells : cells_) blocks_.push_back(frame.Block(cells));
}

void OccupancyGrid::AddOutside() {
  const Frame frame(map_);
  // Far beyond the map, where the sides of one that is turned are not known: that is outside, too.
  const double far = 1024 * (std::abs(map_.origin[0]) + std::abs(map_.origin[1]) +
                             map_.resolution * (static_cast<double>(map_.width) + map_.height));
  for (const std::size_t axis : {0u, 1u})
    for (const double sign : {-1.0, 1.0}) {
      blocks_.push_back(frame.Beyond(axis, sign, far));
      if (map_.yaw != 0)
        blocks_.push_back(Obstacle::HalfSpace(sign * Eigen::Vector2d::Unit(static_cast<Eigen::Index>(axis)), far));
    }
}

OccupancyGrid::Cells OccupancyGrid::cells(int block) const {
  return ToSize(block) < cells_.size() ? cells_[ToSize(block)] : Cells{};
}

std::string OccupancyGrid::NameOf(int block) const {
  const auto [column, row, width, height] = cells(block);
  const auto at = [](int i, int j) { return "(" + std::to_string(i) + ", " + std::to_string(j) + ")"; };
  if (width == 0) return "what is beyond";
  if (width * height == 1) return "cell " + at(column, row);
  return "cells " + at(column, row) + " to " + at(column + width - 1, row + height - 1);
}

OccupancyGrid OccupancyGrid::Shifted(const Eigen::Vector2d& by) const {
  Map map = map_;
  map.origin = {map.origin[0] + by.x(), map.origin[1] + by.y()};
  return OccupancyGrid(std::move(map));
}

}  // namespace forereach
