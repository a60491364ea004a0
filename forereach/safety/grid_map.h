/** What an occupancy grid says, as data. */
#pragma once

#include <array>
#include <vector>

#include "forereach/safety/obstacle.h"

namespace forereach {

/** Cells of the plane, some of them occupied. Cell (i, j) is column i, row j from the lower left one: with the side s,
the origin o and the rotation R by yaw, the closed square o + R {(u, v) : s i <= u <= s (i + 1), s j <= v <= s (j + 1)}.
Unless the outside is free, all of the plane beyond the cells is occupied, too, with its border. */
struct GridMap {
  double resolution = 1;           ///< s, metres.
  std::array<double, 2> origin{};  ///< o, metres: the lower left corner.
  double yaw = 0;                  ///< Radians.
  int width = 0, height = 0;       ///< Columns and rows.
  std::vector<bool> occupied{};    ///< Row by row, the lowest first.
  bool outside_is_free = false;

  [[nodiscard]] bool IsOccupied(int column, int row) const {
    return occupied[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column)];
  }
  friend bool operator==(const GridMap&, const GridMap&) = default;
};

/** @pre the obstacle is a grid. */
[[nodiscard]] const GridMap& MapOf(const Obstacle& grid);

}  // namespace forereach
