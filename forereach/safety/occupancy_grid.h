/** A map of cells (grid_map.h) as one obstacle, the union of closed rectangles, p = 2.

The occupied cells are kept as blocks, which are convex obstacles; each contains its cells and, because numbers are
rounded outward, some units in their last place more. Where the outside is occupied, half-spaces are all beyond the
map. What is clear of each block is clear of the map, and the nearest block is as far as the map. */
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "forereach/safety/grid_map.h"
#include "forereach/safety/obstacle.h"
#include "forereach/safety/obstacle_index.h"

namespace forereach {

class OccupancyGrid final {
 public:
  using Map = GridMap;
  static constexpr int kMostCells = 1 << 24, kMostBlocks = 1 << 17;

  /** @throws std::invalid_argument with the value and its bound: resolution in (0, 1e6], an origin within 1e9, yaw
  within 7, 1 to kMostCells cells, as many as `occupied` has, and not more than kMostBlocks blocks. Cost O(cells) and
  O(n log^2 n) for n blocks. */
  explicit OccupancyGrid(Map map);

  [[nodiscard]] const Map& map() const { return map_; }
  /** Convex: rectangles of occupied cells, none of which is in two of them, then what is beyond the map. */
  [[nodiscard]] std::span<const Obstacle> blocks() const { return blocks_; }
  [[nodiscard]] const ObstacleIndex& index() const { return index_; }
  /** The cells of a block: columns [column, column + width), and rows likewise. All zero: it is beyond the map. */
  struct Cells {
    int column = 0, row = 0, width = 0, height = 0;
  };
  [[nodiscard]] Cells cells(int block) const;
  /** "cell (12, 40)", "cells (12, 40) to (15, 41)", or "what is beyond". */
  [[nodiscard]] std::string NameOf(int block) const;

  /** The least distance(block) of all blocks, which is looked for near a hull: distance(block) is not below that of
  the two. Infinite if there is no block. */
  template <class Distance>
  [[nodiscard]] double LeastDistance(const Hull& hull, const Distance& distance) const {
    double least = kInfinity;
    const auto consider = [&](int block) { least = std::min(least, distance(blocks_[ToSize(block)])); };
    for (const int block : index_.everywhere()) consider(block);
    index_.ForEachNear(
        hull, 0, [&] { return least; }, [&](int block, double) { consider(block); });
    return least;
  }

  /** The same map elsewhere. @throws as the constructor does. */
  [[nodiscard]] OccupancyGrid Shifted(const Eigen::Vector2d& by) const;

 private:
  void FindBlocks();
  void AddOutside();

  Map map_;
  std::vector<Cells> cells_;
  std::vector<Obstacle> blocks_;
  ObstacleIndex index_;  // of these
};

}  // namespace forereach
