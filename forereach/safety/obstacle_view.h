/** The obstacles of a call. */
#pragma once

#include <span>
#include <vector>

#include "forereach/safety/obstacle.h"

namespace forereach {

class ObstacleIndex;

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
