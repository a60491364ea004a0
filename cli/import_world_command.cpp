#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "lcmtypes/printable.h"
#include "records/output_file.h"
#include "task/config.h"
#include "task/files.h"
#include "task/json_text.h"
#include "task/most_obstacles.h"
#include "task/number.h"
#include "worlds/commonroad.h"
#include "worlds/geojson.h"
#include "worlds/occupancy_map.h"
#include "worlds/task_region.h"

namespace forereach {
namespace {

struct ImportWorldArguments {
  std::string file, out, format = "auto", unknown = "occupied", as = "grid", task, region, origin;
  int coarsen = 1, steps_per_window = 1;
  double thickness = CommonRoadOptions{}.thickness;
  std::optional<double> line_width, point_radius;
  bool whole_task = false, metres = false, keep_in = false, force = false, json = false;
};

[[noreturn]] void RefuseOption(const std::string& option, const std::string& what) {
  throw ConfigError("--{}: {}", option, what);
}

std::string FormatOf(const ImportWorldArguments& options) {
  if (options.format != "auto") return options.format;
  const std::string extension = std::filesystem::path(options.file).extension().string();
  if (extension == ".yaml" || extension == ".yml") return "ros";
  if (extension == ".xml") return "commonroad";
  if (extension == ".json" || extension == ".geojson") return "geojson";
  const bool is_image = extension == ".pgm" || extension == ".png";
  throw ConfigError("{}: {}", options.file,
                    is_image ? "is an image; name the YAML file of the map, which says where it is"
                             : "its name does not say what it is; give --format");
}

// "1,2" as so many numbers.
std::vector<double> NumbersOf(const std::string& option, const std::string& text, std::size_t count) {
  std::vector<double> numbers;
  // Up to the end itself, so that a comma there is followed by an empty number, which is refused.
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    const auto [value, problem] = ParseNumber(word);
    if (!problem.empty()) RefuseOption(option, fmt::format("'{}' {}", word, problem));
    numbers.push_back(value);
    begin = end + 1;
  }
  if (numbers.size() != count)
    RefuseOption(option, fmt::format("has {} numbers, has to have {}", numbers.size(), count));
  return numbers;
}

std::optional<Box> RegionOfOptions(const ImportWorldArguments& options) {
  if (!options.task.empty()) return RegionOf(LoadConfig(options.task, TransitionsFile::kIgnore));
  if (options.region.empty()) return std::nullopt;
  const std::vector<double> ends = NumbersOf("region", options.region, 4);
  if (!(ends[0] < ends[2] && ends[1] < ends[3])) RefuseOption("region", "its upper corner is not above its lower one");
  return Box(Eigen::Vector2d(ends[0], ends[1]), Eigen::Vector2d(ends[2], ends[3]));
}

World Read(const ImportWorldArguments& options, const std::string& format) {
  if (format == "ros")
    return ReadOccupancyMap(options.file, {options.unknown == "free", options.coarsen, options.as == "rectangles"});
  if (format == "commonroad") return ReadCommonRoad(options.file, {options.thickness, options.steps_per_window});
  GeoJsonOptions drawing{{}, options.metres, options.keep_in, options.line_width, options.point_radius};
  if (!options.origin.empty()) {
    const std::vector<double> origin = NumbersOf("origin", options.origin, 2);
    if (!(std::abs(origin[0]) <= 180 && std::abs(origin[1]) <= 80))
      RefuseOption("origin", "is no longitude and a latitude of at most 80 degrees");
    drawing.origin = {origin[0], origin[1]};
  }
  return ReadGeoJson(options.file, drawing);
}

std::string TextOf(const ImportWorldArguments& options, const World& world) {
  const std::string origin = std::filesystem::path(options.file).filename().string();
  if (!options.whole_task) return ObstaclesText(world, origin);
  return WithObstacles(ReadWhole(options.task, kLargestTaskFile), world, origin, options.task);
}

int RunImportWorld(const ImportWorldArguments& options) {
  const std::string format = FormatOf(options);
  // Before the reading, which may take long.
  RequireNewFile(options.out, options.force);
  if (options.whole_task && options.task.empty()) RefuseOption("whole-task", "needs --task");
  const std::optional<Box> region = RegionOfOptions(options);
  World world = Read(options, format);
  const std::size_t all = world.pieces.size();
  if (region) world = Cropped(std::move(world), *region);
  const std::size_t count = world.pieces.size();
  // All or nothing: a part of the obstacles would be a world with holes.
  const bool fits = count <= kMostObstacles;
  if (fits) WriteNewFile(options.out, TextOf(options, world), options.force);
  if (options.json) {
    std::cout << JsonText(nlohmann::json{{"format", format},
                                         {"pieces", all},
                                         {"obstacles", count},
                                         {"most", kMostObstacles},
                                         {"notes", world.notes},
                                         {"out", fits ? nlohmann::json(options.out) : nlohmann::json(nullptr)}})
              << std::endl;
  } else {
    for (const std::string& note : world.notes) std::cout << "  " << Printable(note) << "\n";
    if (region) std::cout << fmt::format("  In the region: {} of {} pieces, with half-planes around it.\n", count, all);
    if (fits) std::cout << fmt::format("import-world: {} obstacles in {}", count, options.out) << std::endl;
  }
  if (!fits)
    std::cerr << fmt::format(
        "forereach: {} obstacles, and a task takes {}: nothing is written. --task or --region keeps what lies where "
        "the robot drives; {} makes fewer and larger pieces.\n",
        count, kMostObstacles,
        format == "ros"          ? "--as grid"
        : format == "commonroad" ? "--thickness or --steps-per-window"
                                 : "a simpler drawing");
  return fits ? 0 : 1;
}

}  // namespace

Command ImportWorldCommand() {
  const auto options = std::make_shared<ImportWorldArguments>();
  return {
      .name = "import-world",
      .footer =
          "FILE is the YAML file of a ROS map, a CommonRoad 2020a or 2018b scenario (.xml), or GeoJSON. OUT has the "
          "list task.obstacles; put it into a task file.\nThe obstacles contain all that the file says is not free. "
          "OUT begins with what was assumed.\n\n"
          "Examples:\n  forereach import-world map.yaml --task my_robot.yaml --whole-task --out my_robot_in_map.yaml\n"
          "  forereach import-world scenario.xml --region 0,-10,60,10 --steps-per-window 5 --out obstacles.yaml\n"
          "  forereach import-world site.geojson --origin 11.58,48.14 --line-width 0.2 --out obstacles.yaml",
      .options = {Required({"FILE", &options->file, "FILE", "What to read"}),
                  Required({"--out", &options->out, "OUT.yaml", "The obstacles, as a part of a task file"}),
                  OneOf({"auto", "ros", "commonroad", "geojson"},
                        {"--format", &options->format, "", "What FILE is; by default its name says it"}),
                  Excluding("--region", {"--task", &options->task, "TASK",
                                         "Keep what may lie in the positions of this task's domain, with the reach of "
                                         "its body; all outside counts as occupied"}),
                  {"--whole-task", &options->whole_task, "",
                   "OUT is that task with its line `obstacles: []` replaced; put it beside the task, whose other files "
                   "it names"},
                  {"--region", &options->region, "XMIN,YMIN,XMAX,YMAX", "The same for a box, in metres"},
                  OneOf({"occupied", "free"},
                        {"--unknown", &options->unknown, "", "ros: what unknown cells are, and all beyond the image"}),
                  OneOf({"grid", "rectangles"},
                        {"--as", &options->as, "", "ros: one grid, or its occupied cells as rectangles"}),
                  {"--coarsen", &options->coarsen, "N", "ros: a block of N by N cells is occupied if one of them is",
                   NumberRange{1, 1000}},
                  {"--thickness", &options->thickness, "M",
                   "commonroad: consecutive segments of the boundary are one piece while they lie so near its chord",
                   NumberRange{0, 10}},
                  {"--steps-per-window", &options->steps_per_window, "N",
                   "commonroad: of what moves, one obstacle for so many time steps", NumberRange{1, 1000}},
                  {"--origin", &options->origin, "LON,LAT",
                   "geojson: coordinates are degrees, and x = y = 0 is here; x to the east, y to the north"},
                  {"--metres", &options->metres, "", "geojson: coordinates are metres, even if they look like degrees"},
                  {"--keep-in", &options->keep_in, "",
                   "geojson: stay in the areas, but for those with the property keep_in: false"},
                  {"--line-width", &options->line_width, "M", "geojson: of lines without the property width",
                   NumberRange{0, 1e6}},
                  {"--point-radius", &options->point_radius, "M", "geojson: of points without the property radius",
                   NumberRange{0, 1e6}},
                  {"--force", &options->force, "", "Replace OUT if it exists"},
                  JsonFlag(options->json)},
      .run = [options] { return RunImportWorld(*options); }};
}

}  // namespace forereach
