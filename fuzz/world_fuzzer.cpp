// Maps, scenarios and drawings of others: any bytes are a world whose numbers are finite and whose text a task's reader
// would take, or refused with a ConfigError. The first byte chooses the format.
#include <cmath>
#include <stdexcept>

#include "forereach/safety/occupancy_grid.h"
#include "fuzz/fuzz.h"
#include "fuzz/text_mutator.h"
#include "task/config_error.h"
#include "worlds/commonroad.h"
#include "worlds/geojson.h"
#include "worlds/occupancy_map.h"

namespace forereach {
namespace {

World Read(unsigned choice, const std::string& path, Bytes data) {
  switch (choice % 3) {
    case 0: return ReadCommonRoad(path, {.thickness = choice & 8 ? 0.1 : 0, .steps_per_window = choice & 16 ? 3 : 1});
    case 1: {
      GeoJsonOptions options{.are_metres = true, .keep_in = (choice & 8) != 0, .line_width = 0.5, .point_radius = 1};
      if (choice & 16) options.origin = PlanePoint{11, 48};
      return ReadGeoJson(path, options);
    }
    default: {
      const GrayImage image = ReadPgm("map.pgm", {reinterpret_cast<const char*>(data.data()), data.size()});
      Require(std::ssize(image.values) == std::int64_t{image.width} * image.height);
      OccupancyGrid::Map map{1, {0, 0}, 0, image.width, image.height, {}, true};
      for (const std::uint16_t value : image.values) {
        Require(value <= image.largest);
        map.occupied.push_back(2 * value < image.largest);
      }
      World world;
      try {
        const OccupancyGrid grid(map);
        for (const Obstacle& block : grid.blocks()) world.Add("cells", block);
      } catch (const std::invalid_argument& error) {
        throw ConfigError(error.what());
      }
      return world;
    }
  }
}

}  // namespace

bool Try(Bytes data) {
  static MemoryFile file;
  const unsigned choice = data.empty() ? 0 : data[0];
  const Bytes content = data.subspan(data.empty() ? 0 : 1);
  const std::string& path = file.Write(content);
  return IsTaken([&] {
    World world = Read(choice, path, content);
    for (const World::Piece& piece : world.pieces) {
      Require(piece.obstacle.dim() == 2 && std::isfinite(piece.obstacle.radius()));
      Require(!piece.window || piece.window->from <= piece.window->until);
    }
    world = Cropped(std::move(world), Box(Eigen::Vector2d(-5, -5), Eigen::Vector2d(5, 5)));
    Require(!ObstaclesText(world, "any").empty());
    if (world.pieces.empty()) throw ConfigError("nothing");  // it did not go deep
  });
}

}  // namespace forereach
