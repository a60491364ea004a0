#include "forereach/safety/obstacle_index.h"

#include <algorithm>

#include "forereach/safety/occupancy_grid.h"

namespace forereach {

ConvexNumbers::ConvexNumbers(std::span<const Obstacle> all) noexcept {
  for (const Obstacle& obstacle : all) {
    const bool is_known = obstacle.grid() && num_grids_ < kMostGrids;
    if (is_known) grids_[ToSize(num_grids_++)] = {size_, obstacle.convex()};
    size_ += is_known ? static_cast<int>(obstacle.convex().size()) : 1;
  }
}

int ConvexNumbers::NumberOf(const Place& place) const {
  int number = place.obstacle;
  for (int g = 0; g < num_grids_ && grids_[ToSize(g)].first < number; ++g)
    number += static_cast<int>(grids_[ToSize(g)].blocks.size()) - 1;
  return number + std::max(place.block, 0);
}

const BoxTree& ObstacleIndex::tree_of(const OccupancyGrid& grid) { return grid.index().tree_; }

ObstacleIndex::ObstacleIndex(std::span<const Obstacle> obstacles) : numbers_(obstacles) {
  std::vector<Bounds> boxes;
  std::vector<const Obstacle*> moving;
  int number = 0;
  for (const Obstacle& obstacle : obstacles) {
    if (obstacle.grid() && grids_.size() < ConvexNumbers::kMostGrids) {
      const ObstacleIndex& own = obstacle.grid()->index();
      grids_.push_back({number, obstacle.grid()});
      for (const int block : own.everywhere()) everywhere_.push_back(number + block);
      size_ = std::max(size_, own.size());
      number += own.numbers().size();
      continue;
    }
    // What has no box is asked about always: an index may only leave out what is provably away.
    if (obstacle.kind() == Obstacle::Kind::kHalfSpace || obstacle.grid()) {
      everywhere_.push_back(number++);
      continue;
    }
    if (obstacle.motion()) {
      moving_.push_back(number++);
      moving.push_back(&obstacle);
      continue;
    }
    standing_.push_back(number++);
    Bounds& box = boxes.emplace_back();
    for (int k = 0; k < obstacle.dim(); ++k) {
      // Outward: a box that is too small would leave an obstacle out.
      box.lower[ToSize(k)] = SubDown(obstacle.lower()[k], obstacle.radius());
      box.upper[ToSize(k)] = AddUp(obstacle.upper()[k], obstacle.radius());
    }
  }
  if (!boxes.empty()) tree_ = BoxTree(boxes, obstacles.front().dim());
  size_ = std::max(size_, tree_.size());
  moving_tree_ = MotionTree(moving);
}

}  // namespace forereach
