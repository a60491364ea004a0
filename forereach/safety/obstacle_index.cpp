#include "forereach/safety/obstacle_index.h"

namespace forereach {

ObstacleIndex::ObstacleIndex(std::span<const Obstacle> obstacles) {
  std::vector<Bounds> boxes;
  for (std::size_t o = 0; o < obstacles.size(); ++o) {
    const Obstacle& obstacle = obstacles[o];
    const bool is_bounded = obstacle.kind() != Obstacle::Kind::kHalfSpace;
    if (!is_bounded || obstacle.motion()) {
      everywhere_.push_back(static_cast<int>(o));
      continue;
    }
    standing_.push_back(static_cast<int>(o));
    Bounds& box = boxes.emplace_back();
    for (int k = 0; k < obstacle.dim(); ++k) {
      box.lower[ToSize(k)] = SubDown(obstacle.lower()[k], obstacle.radius());
      box.upper[ToSize(k)] = AddUp(obstacle.upper()[k], obstacle.radius());
    }
  }
  if (!boxes.empty()) tree_ = BoxTree(boxes, obstacles.front().dim());
}

}  // namespace forereach
