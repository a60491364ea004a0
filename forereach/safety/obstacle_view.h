/** The obstacles of a call. */
#pragma once

#include <array>
#include <span>
#include <vector>

#include "forereach/safety/obstacle.h"

namespace forereach {

class ObstacleIndex;

/** The convex sets of a list of obstacles, numbered in its order: an obstacle has one number, a grid one for each of
its blocks. */
class ConvexNumbers final {
 public:
  static constexpr int kMostGrids = 8;
  ConvexNumbers() = default;
  /** A grid after the first kMostGrids counts as one set, of which nothing is known but its bounding box. */
  explicit ConvexNumbers(std::span<const Obstacle> all) noexcept;

  /** How many there are. */
  [[nodiscard]] int size() const { return size_; }
  /** @param all the obstacles. */
  [[nodiscard]] const Obstacle& Find(std::span<const Obstacle> all, int number) const {
    const auto [obstacle, block] = PlaceOf(number);
    const Obstacle& found = all[static_cast<std::size_t>(obstacle)];
    return block < 0 ? found : found.convex()[static_cast<std::size_t>(block)];
  }
  struct Place {
    int obstacle, block;  ///< -1: the obstacle is no grid.
  };
  [[nodiscard]] Place PlaceOf(int number) const {
    int obstacle = number;
    for (int g = 0; g < num_grids_ && grids_[g].first <= number; ++g) {
      const auto& [first, blocks] = grids_[g];
      const int count = static_cast<int>(blocks.size());
      if (number - first < count) return {obstacle - (number - first), number - first};
      obstacle -= count - 1;
    }
    return {obstacle, -1};
  }
  /** @pre the obstacle is there, and so is the block of one that is a grid. */
  [[nodiscard]] int NumberOf(const Place& place) const;

 private:
  struct Grid {
    int first;
    std::span<const Obstacle> blocks;
  };
  int size_ = 0, num_grids_ = 0;
  std::array<Grid, kMostGrids> grids_{};
};

/** Obstacles, and their index (obstacle_index.h) if they have one. It owns neither. With an index a call gives the same
decision, sooner where obstacles are many. */
class ObstacleView final {
 public:
  ObstacleView() = default;
  ObstacleView(std::span<const Obstacle> all) : all_(all) {}     // NOLINT: without an index
  ObstacleView(const std::vector<Obstacle>& all) : all_(all) {}  // NOLINT
  ObstacleView(const Obstacle* first, std::size_t count) : all_(first, count) {}
  /** @pre the index is that of these obstacles. */
  ObstacleView(std::span<const Obstacle> all, const ObstacleIndex& index) : all_(all), index_(&index) {}

  [[nodiscard]] std::span<const Obstacle> all() const { return all_; }
  [[nodiscard]] std::size_t size() const { return all_.size(); }
  [[nodiscard]] const Obstacle& operator[](std::size_t o) const { return all_[o]; }
  /** Null if it has none. */
  [[nodiscard]] const ObstacleIndex* index() const { return index_; }

 private:
  std::span<const Obstacle> all_;
  const ObstacleIndex* index_ = nullptr;
};

}  // namespace forereach
