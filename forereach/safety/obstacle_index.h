/** Finds the obstacles near a hull. It is made once for a set of obstacles; a test of a plan then looks only at those
within its reach. */
#pragma once

#include <span>
#include <vector>

#include "forereach/safety/box_tree.h"
#include "forereach/safety/obstacle_view.h"

namespace forereach {

class ObstacleIndex final {
 public:
  ObstacleIndex() = default;
  /** Those that stand and have a size are in a tree of the boxes around them. Those that move, and half-spaces, are
  near everything. @pre all have one dimension. Cost O(n log^2 n). */
  explicit ObstacleIndex(std::span<const Obstacle> obstacles);

  /** Those that are near everything, by their indices. */
  [[nodiscard]] std::span<const int> everywhere() const { return everywhere_; }
  /** An upper bound on the absolute values of the coordinates of the others, and on their radii. */
  [[nodiscard]] double size() const { return tree_.size(); }
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

}  // namespace forereach
