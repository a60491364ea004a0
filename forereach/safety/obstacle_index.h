/** Finds the obstacles near a hull. It is made once for a set of obstacles; a test of a plan then looks only at those
within its reach. */
#pragma once

#include <span>
#include <vector>

#include "forereach/safety/box_tree.h"
#include "forereach/safety/motion_tree.h"
#include "forereach/safety/obstacle_view.h"

namespace forereach {

class ObstacleIndex final {
 public:
  ObstacleIndex() = default;
  /** Obstacles with a size are in trees: those that stand, those that move, and the blocks of each grid. Half-spaces
  are near everything. Obstacles are known by ConvexNumbers. @pre all have one dimension. Cost O(n log n) for n
  obstacles that are no grids. */
  explicit ObstacleIndex(std::span<const Obstacle> obstacles);

  [[nodiscard]] const ConvexNumbers& numbers() const { return numbers_; }
  /** Those that are near everything. */
  [[nodiscard]] std::span<const int> everywhere() const { return everywhere_; }
  /** An upper bound on the absolute values of the coordinates of those that stand, and on their radii. */
  [[nodiscard]] double size() const { return size_; }
  /** BoxTree::ForEachNear of those that stand: visit(o, least). One that is left out is proven apart by SeparateHulls,
  with `reach` added, and its clearance there exceeds `within()`; or by its `gap`, if that is given. */
  template <class Within, class Visit, class... Gap>
  void ForEachNear(const Hull& hull, double reach, const Within& within, const Visit& visit, const Gap&... gap) const {
    for (std::size_t g = 0; g <= grids_.size(); ++g)
      Tree(g).ForEachNear(
          hull, reach, within, [&](int i, double least) { visit(Number(g, i), least); }, gap...);
  }
  /** BoxTree::FindNear of those that stand: its box is the obstacle. */
  template <class Gap>
  [[nodiscard]] FOREREACH_INLINE BoxTree::Found FindNear(const Hull& hull, const Gap& gap) const noexcept {
    BoxTree::Found nearest;
    for (std::size_t g = 0; g <= grids_.size(); ++g)
      if (const BoxTree::Found found = Tree(g).FindNear(hull, gap); found.square < nearest.square)
        nearest = {Number(g, found.box), found.square};
    return nearest;
  }

  [[nodiscard]] bool has_moving() const { return !moving_.empty(); }
  /** MotionTree::ForEachNear of those that move: visit(t, o). */
  template <class Within, class Visit>
  void ForEachNearMoving(const HullTree& hulls, const MotionTree::Times& times, double reach, const Within& within,
                         const Visit& visit) const {
    moving_tree_.ForEachNear(hulls, times, reach, within, [&](int t, int i) { visit(t, moving_[ToSize(i)]); });
  }

 private:
  struct Grid {
    int first;
    std::shared_ptr<const OccupancyGrid> grid;
  };
  // Of its blocks, whose first ones have all a size.
  [[nodiscard]] static const BoxTree& tree_of(const OccupancyGrid& grid);
  // Those of the grids, and then that of the others.
  [[nodiscard]] const BoxTree& Tree(std::size_t g) const {
    return g < grids_.size() ? tree_of(*grids_[g].grid) : tree_;
  }
  [[nodiscard]] int Number(std::size_t g, int i) const {
    return g < grids_.size() ? grids_[g].first + i : standing_[ToSize(i)];
  }

  ConvexNumbers numbers_;
  std::vector<int> everywhere_, standing_, moving_;
  std::vector<Grid> grids_;
  BoxTree tree_;  // of those that stand
  MotionTree moving_tree_;
  double size_ = 0;
};

}  // namespace forereach
