/** Finds the obstacles near a hull. It is made once for a set of obstacles; a test of a plan then looks only at those
within its reach. */
#pragma once

#include <span>
#include <vector>

#include "forereach/safety/box_tree.h"
#include "forereach/safety/obstacle.h"

namespace forereach {

class ObstacleIndex final {
 public:
  ObstacleIndex() = default;
  /** Those that stand and have a size are in a tree of the boxes around them. Those that move, and half-spaces, are
  near everything. @pre all have one dimension. Cost O(n log^2 n). */
  explicit ObstacleIndex(std::span<const Obstacle> obstacles);

  /** Those that are near everything, by their indices. */
  [[nodiscard]] std::span<const int> everywhere() const { return everywhere_; }
  /** BoxTree::ForEachNear of the others: visit(t, o). One that is left out is proven apart by SeparateHulls, with
  `reach` added, and its clearance there exceeds `within()`. */
  template <class Within, class Visit>
  void ForEachNear(const HullTree& hulls, double reach, const Within& within, const Visit& visit) const {
    tree_.ForEachNear(hulls, reach, within, [&](int t, int i) { visit(t, standing_[ToSize(i)]); });
  }

 private:
  std::vector<int> everywhere_, standing_;
  BoxTree tree_;  // of those that stand
};

/** The obstacles of a call, and their index if they have one. It owns neither. With an index a call gives the same
decision, sooner where obstacles are many. */
class ObstacleView final {
 public:
  ObstacleView() = default;
  ObstacleView(std::span<const Obstacle> all) : all_(all) {}           // NOLINT: without an index
  ObstacleView(const std::vector<Obstacle>& all) : all_(all) {}        // NOLINT
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
