/** Polygons for a screen: fewer corners, in 16 bits. For display, not for bounds. */
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "records/picture.h"

namespace forereach {

/** The corners of a convex polygon without those that change it little: what is left out lies within `tolerance` of
the rest. Keeps at least three corners of three. */
[[nodiscard]] Picture::Polygon Simplified(const Picture::Polygon& polygon, double tolerance);

/** The polygons of a tube on a grid. A coordinate is origin + quantum * number. */
struct Sketch {
  static constexpr double kTolerance = 0.005;  ///< Of the diameter of a polygon.
  static constexpr int kGrid = 1 << 14;        ///< Numbers are at most this large.

  double x = 0, y = 0, quantum = 0;
  std::vector<std::uint8_t> parts;    ///< Number of polygons in each unit.
  std::vector<std::uint8_t> corners;  ///< Number of corners of each polygon.
  std::vector<std::int16_t> points;   ///< x and y of each corner; of a polygon's later ones the difference to the last.
};

/** The sketch of the polygons of each unit. Nothing if a number is not finite, or a count does not fit. */
[[nodiscard]] std::optional<Sketch> MakeSketch(const std::vector<std::vector<Picture::Polygon>>& units);

}  // namespace forereach
