/** Conversion between obstacles and messages. */
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forereach/obstacles_t.hpp"
#include "forereach/safety/obstacle.h"

namespace forereach {

/** How far the stamp of a moving obstacle may be from the stamp of its message, in both directions: a day. A stamp
further away is not of the clock that stamped the message. */
inline constexpr std::int64_t kFarthestStampUs = 86'400'000'000;

/** What grids of a set have room for: so many of them, with so many cells and blocks in all. A receiver makes them as
soon as it has the set, and readers of logs keep many sets. */
class GridRoom final {
 public:
  static constexpr int kMostGrids = 4, kMostCells = 1 << 18, kMostBlocks = 1 << 13;

  [[nodiscard]] bool HasCells(std::int64_t cells) const { return grids_ < kMostGrids && cells <= kMostCells - cells_; }
  /** False, and nothing is taken, if there is none. @pre it is a grid. */
  [[nodiscard]] bool Take(const Obstacle& grid);

 private:
  int grids_ = 0;
  std::int64_t cells_ = 0, blocks_ = 0;
};

/** The obstacles of a set, in its order; a grid and the pieces with its cells are one. The windows of a track's pieces
have to cover all times from `stamp`, the message's, until the track is gone:
- The first window begins no later than the stamp. It is taken to have no beginning, because an obstacle does
  not appear from nowhere.
- Each later window begins no later than the latest end of those before it.
- A piece that is `gone` ends last. Without such a piece, the windows that end last are taken to have no end.
A piece that neither moves nor grows and has neither beginning nor end is an obstacle without a motion.
@throws std::invalid_argument with the obstacle's index and its error if an obstacle is invalid or its dimension is not
`dim`; if a track breaks these rules, with the track and the times; if a window is empty, `gone` is neither 0 nor 1, or
a piece that moves or grows is stamped further than kFarthestStampUs from `stamp`; if a grid moves, has not all its
cells behind it, or the set has no GridRoom for it; and as Obstacle::Moving and Named.
@param known grids of the same cells as one of these share what was made of it. */
[[nodiscard]] std::vector<Obstacle> FromMessage(std::span<const obstacle_t> pieces, std::int64_t stamp, int dim,
                                                std::span<const Obstacle> known = {});
/** Those of a message. @throws std::invalid_argument also if it has more than kMaxObstacles. */
[[nodiscard]] std::vector<Obstacle> FromMessage(const obstacles_t& message, int dim);

/** Whether the window of an obstacle begins where that of the one before it ends. */
[[nodiscard]] bool Continues(const Obstacle& obstacle, const Obstacle& before);

/** Obstacles as in messages; those that stand have the stamp `utime`. A grid has several pieces.
@param tracks one for each obstacle. If empty, an obstacle that Continues the one before it is of its track, and
every other is a track of its own. The last piece of a track with an end is `gone` there. */
[[nodiscard]] std::vector<obstacle_t> ToPieces(const std::vector<Obstacle>& obstacles, std::int64_t utime,
                                               std::span<const std::int64_t> tracks = {});

/** The message that has all of them, with this stamp. @pre at most kMaxObstacles pieces. */
[[nodiscard]] obstacles_t ToMessage(const std::vector<Obstacle>& obstacles, std::int64_t utime,
                                    std::span<const std::int64_t> tracks = {});

}  // namespace forereach
