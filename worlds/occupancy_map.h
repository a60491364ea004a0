/** Maps of ROS: a YAML file that names a PGM or PNG image of cells, as map_saver writes them and map_server reads them.
 */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "worlds/world.h"

namespace forereach {

struct MapOptions {
  bool unknown_is_free = false;
  /** A block of so many cells by so many is occupied if one of its cells is. */
  int coarsen = 1;
  bool as_rectangles = false;  ///< A world of rectangles that cover the occupied cells, not of one grid.
};

/** Gray values, the rows from top to bottom. */
struct GrayImage {
  int width = 0, height = 0, largest = 0;  ///< `largest` is white.
  std::vector<std::uint16_t> values;
};

/** The most pixels of an image: what it takes of memory is at most 16 bytes each. */
inline constexpr std::int64_t kMaxPixels = std::int64_t{1} << 26;

/** An image in the format P2 or P5 of netpbm, with comments in its header and 1 to 65535 as its largest value.
@param file its name in messages. @throws ConfigError if it is another format, has more than kMaxPixels, ends early, or
has a value above the largest. */
[[nodiscard]] GrayImage ReadPgm(const std::string& file, std::string_view bytes);

/** The same of a PNG image: of each pixel the sum of red, green and blue. @param file its name in messages.
@throws ConfigError if it is none that can be read, has more than kMaxPixels, or a pixel is not opaque. */
[[nodiscard]] GrayImage ReadPng(const std::string& file, std::string_view bytes);

/** The occupied cells of a map as a grid that is named as the file is, or as rectangles: boxes, or polygons if its
origin is turned, each with its cells and at most the rounding of its corners more. With unknown cells occupied, so is
all beyond the image. A cell is occupied, free or unknown as for map_server in mode trinary, but gray 205 of 255, which
map_saver writes for unknown, is unknown whatever the thresholds say. In mode scale, what is neither free nor occupied
is occupied; in mode raw, what has a cost. @throws ConfigError with file, line, key and value. */
[[nodiscard]] World ReadOccupancyMap(const std::string& path, const MapOptions& options);

}  // namespace forereach
