/** Counts the obstacles that a reader of records keeps, so that sets of many, each another one, do not fill the memory.
 */
#pragma once

#include <cstddef>
#include <map>
#include <span>

#include "forereach/safety/obstacle.h"

namespace forereach {

/** Sets of obstacles, each counted once wherever it is shared, and so the blocks of each grid. A block takes about half
a kilobyte. Whoever keeps sets in a queue drops the first ones while there are too many, but never the last one; what
that one has does not count, since grids of a task, in all its sets, would leave no room for another. */
class KeptObstacles final {
 public:
  static constexpr std::size_t kMost = 1 << 18;

  KeptObstacles() = default;
  explicit KeptObstacles(std::size_t most) : most_(most) {}

  /** @param set stays where it is until it is removed. */
  void Add(std::span<const Obstacle> set) {
    Count(set, true);
    newest_ = set.size();
    for (const Obstacle& obstacle : set) newest_ += obstacle.grid() ? obstacle.convex().size() : 0;
  }
  /** @pre it was added, and is still there. */
  void Remove(std::span<const Obstacle> set) { Count(set, false); }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool AreTooMany() const { return size_ > most_ + newest_; }

 private:
  void Count(std::span<const Obstacle> set, bool is_added) {
    if (set.empty() || !Changes(set.data(), set.size(), is_added)) return;
    for (const Obstacle& obstacle : set)
      if (obstacle.grid()) static_cast<void>(Changes(obstacle.grid().get(), obstacle.convex().size(), is_added));
  }

  // Whether this is the first or the last use.
  bool Changes(const void* what, std::size_t size, bool is_added) {
    std::size_t& uses = uses_[what];
    if (is_added ? uses++ > 0 : --uses > 0) return false;
    size_ += is_added ? size : -size;
    if (!is_added) uses_.erase(what);
    return true;
  }

  std::size_t most_ = kMost, size_ = 0, newest_ = 0;
  std::map<const void*, std::size_t> uses_;  // of sets and of grids
};

}  // namespace forereach
