#include "worlds/occupancy_map.h"

#include <cairo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>

#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/safety/occupancy_grid.h"
#include "task/config_error.h"
#include "task/document.h"
#include "task/draft.h"
#include "task/files.h"
#include "task/key_rows.h"

namespace forereach {
namespace {

// ---- The image

class PgmReader {
 public:
  PgmReader(const std::string& file, std::string_view bytes) : file_(file), rest_(bytes), all_(bytes.size()) {}

  GrayImage Read() {
    const std::string_view kind = rest_.substr(0, 2);
    if (kind != "P2" && kind != "P5")
      Fail(
          "is neither a PGM image, which begins with P2 or P5, nor a PNG; `convert IMAGE map.pgm` of ImageMagick makes "
          "one");
    rest_.remove_prefix(2);
    GrayImage image;
    image.width = Number("width", kMaxPixels);
    image.height = Number("height", kMaxPixels);
    image.largest = Number("largest value", 65'535);
    if (image.width < 1 || image.height < 1 || image.largest < 1) Fail("has no pixels");
    const std::int64_t pixels = std::int64_t{image.width} * image.height;
    if (pixels > kMaxPixels) Fail(fmt::format("has {} pixels, at most {} are taken", pixels, kMaxPixels));
    if (kind == "P5") ReadBytes(image, static_cast<std::size_t>(pixels));
    if (kind == "P2") ReadWords(image, static_cast<std::size_t>(pixels));
    return image;
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    throw ConfigError("{}: at byte {}: {}", file_, all_ - rest_.size(), what);
  }

  static bool IsSpace(char c) { return c == ' ' || ('\t' <= c && c <= '\r'); }

  void SkipSpaceAndComments() {
    while (!rest_.empty() && (IsSpace(rest_[0]) || rest_[0] == '#'))
      rest_.remove_prefix(rest_[0] == '#' ? std::min(rest_.find('\n'), rest_.size()) : 1);
  }

  int Number(const char* what, std::int64_t most) {
    SkipSpaceAndComments();
    std::int64_t value = 0;
    std::size_t digits = 0;
    for (; digits < rest_.size() && '0' <= rest_[digits] && rest_[digits] <= '9'; ++digits)
      if ((value = 10 * value + (rest_[digits] - '0')) > most) Fail(fmt::format("the {} is above {}", what, most));
    if (digits == 0) Fail(fmt::format("no number where the {} has to be", what));
    rest_.remove_prefix(digits);
    return static_cast<int>(value);
  }

  void ReadBytes(GrayImage& image, std::size_t pixels) {
    if (rest_.empty() || !IsSpace(rest_[0])) Fail("no white space behind the largest value");
    rest_.remove_prefix(1);
    const std::size_t each = image.largest < 256 ? 1 : 2;
    if (rest_.size() < each * pixels)
      Fail(fmt::format("the file is cut off: {} bytes of pixels, it has to have {}", rest_.size(), each * pixels));
    image.values.reserve(pixels);
    const auto byte = [this](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(rest_[i])); };
    for (std::size_t i = 0; i < pixels; ++i) Take(image, each == 1 ? byte(i) : 256 * byte(2 * i) + byte(2 * i + 1), i);
    rest_.remove_prefix(each * pixels);
    // After a late comment, or with a wrong size, every cell would be in the wrong place.
    if (!std::ranges::all_of(rest_, IsSpace))
      Fail(fmt::format("{} bytes behind the last pixel; the pixels begin one byte behind the largest value",
                       rest_.size()));
  }

  void ReadWords(GrayImage& image, std::size_t pixels) {
    if (rest_.size() < 2 * pixels) Fail(fmt::format("the file is cut off: it has to have {} pixels", pixels));
    image.values.reserve(pixels);
    for (std::size_t i = 0; i < pixels; ++i) Take(image, static_cast<unsigned>(Number("next pixel", 65'535)), i);
  }

  void Take(GrayImage& image, unsigned value, std::size_t i) const {
    if (value > static_cast<unsigned>(image.largest))
      Fail(fmt::format("pixel {} is {}, above the largest value {}", i, value, image.largest));
    image.values.push_back(static_cast<std::uint16_t>(value));
  }

  const std::string& file_;
  std::string_view rest_;
  const std::size_t all_;
};

// ---- What the YAML file says

struct MapFile {
  std::string image, mode = "trinary";
  double resolution = 0, occupied = 0, free = 0;
  std::array<double, 3> origin{};  // x, y, yaw of the lower left corner
  bool is_negated = false;
  std::vector<std::string> unknown_keys;
};

std::vector<Key> MapKeys(MapFile& map) {
  using namespace key_rows;
  const Range share{0, 1, false, false};
  return {
      Map("", "A map of map_server."),
      Required(Text("image", "The image, relative to this file.",
                    [&map](const Field& at, TaskDraft&) { map.image = at.Text(); })),
      Required(Number("resolution", "m", kPositive, "The side of a cell.",
                      [&map](const Field& at, TaskDraft&) { map.resolution = at.Number(); })),
      Required(Vector("origin", "m", key_rows::Between(-1e9, 1e9), Key::Size::kAny,
                      "x, y and yaw of the lower left corner.",
                      [&map](const Field& at, TaskDraft&) {
                        if (at.Count() != 2 && at.Count() != 3) at.Fail("has to have x, y and yaw");
                        if (at.Count() == 3 && std::abs(at[2].Number()) > 7) at.Fail("has a yaw above a turn");
                        for (Eigen::Index k = 0; k < at.Count(); ++k) map.origin[ToSize(k)] = at[k].Number();
                      })),
      Optional(Word("negate", {"0", "1", "false", "true", "False", "True"}, "Whether white is occupied.",
                    [&map](const Field& at, TaskDraft&) {
                      map.is_negated = at.Text() == "1" || at.Text() == "true" || at.Text() == "True";
                    }),
               "0"),
      Required(Number("occupied_thresh", "", share, "A cell that is darker is occupied.",
                      [&map](const Field& at, TaskDraft&) { map.occupied = at.Number(); })),
      Required(Number("free_thresh", "", share, "A cell that is lighter is free.",
                      [&map](const Field& at, TaskDraft&) { map.free = at.Number(); })),
      Optional(Word("mode", {"trinary", "scale", "raw"}, "What values between the two thresholds are.",
                    [&map](const Field& at, TaskDraft&) { map.mode = at.Text(); }),
               "trinary"),
      Text("<name>", "Ignored.", [&map](const Field& at, TaskDraft&) { map.unknown_keys.push_back(at.name()); }),
  };
}

MapFile ReadMapFile(const std::string& path) {
  MapFile map;
  const std::vector<Key> keys = MapKeys(map);
  Document document(path);
  TaskDraft draft;
  document.Read(draft, keys);
  if (map.free > map.occupied) document.Fail("free_thresh", "is above occupied_thresh");
  if (map.mode == "raw" && map.is_negated)
    document.Fail("negate", "has no one meaning with mode raw: map_server of ROS 2 ignores it there; write negate: 0");
  return map;
}

// ---- Cells

// What map_saver writes for unknown cells. Its free_thresh of 0.25 would take it for free.
bool IsSaversUnknown(const GrayImage& image, const MapFile& file, int value) {
  return file.mode == "trinary" && !file.is_negated && 255 * value == 205 * image.largest;
}

OccupancyGrid::Map CellsOf(const GrayImage& image, const MapFile& file, const MapOptions& options) {
  // By gray value, since there are few of them.
  std::vector<bool> is_occupied(ToSize(image.largest) + 1);
  for (int value = 0; value <= image.largest; ++value) {
    const double dark = static_cast<double>(file.is_negated ? value : image.largest - value) / image.largest;
    const bool takes_unknown = options.unknown_is_free && file.mode == "trinary";
    is_occupied[ToSize(value)] = file.mode == "raw" ? value != 0
                                 : takes_unknown    ? dark > file.occupied
                                                    : IsSaversUnknown(image, file, value) || !(dark < file.free);
  }
  OccupancyGrid::Map map{
      file.resolution,        {file.origin[0], file.origin[1]}, file.origin[2], image.width, image.height, {},
      options.unknown_is_free};
  map.occupied.resize(image.values.size());
  const int n = options.coarsen;
  const auto at = [&](int column, int row) { return ToSize(row) * ToSize(map.width) + ToSize(column); };
  for (int row = 0; row < map.height; ++row)  // the lowest first
    for (int column = 0; column < map.width; ++column) {
      if (!is_occupied[image.values[at(column, map.height - 1 - row)]]) continue;
      const int left = column / n * n, low = row / n * n;
      if (map.occupied[at(left, low)] && n > 1) continue;  // so is all of its block
      for (int j = low; j < std::min(low + n, map.height); ++j)
        for (int i = left; i < std::min(left + n, map.width); ++i) map.occupied[at(i, j)] = true;
    }
  return map;
}

}  // namespace

GrayImage ReadPng(const std::string& file, std::string_view bytes) {
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
    return value;
  };
  constexpr std::size_t kHead = 25;  // up to width, height and bits
  // Looked at before the library allocates what the image says.
  if (bytes.size() < kHead || bytes.substr(8, 8) != std::string_view("\0\0\0\rIHDR", 8) ||
      std::uint64_t{number(16)} * number(20) > kMaxPixels)
    throw ConfigError("{}: has no size, or more than {} pixels", file, kMaxPixels);
  if (bytes[24] == 16)
    throw ConfigError(
        "{}: has 16 bits a channel, of which 8 would be lost; `convert IMAGE map.pgm` of ImageMagick keeps them", file);
  const auto read = [](void* rest, unsigned char* to, unsigned count) noexcept {
    auto& from = *static_cast<std::string_view*>(rest);
    if (count > from.size()) return CAIRO_STATUS_READ_ERROR;
    std::copy_n(from.begin(), count, to);
    from.remove_prefix(count);
    return CAIRO_STATUS_SUCCESS;
  };
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create_from_png_stream(read, &bytes), &cairo_surface_destroy);
  cairo_surface_t* const image = surface.get();
  const cairo_format_t format = cairo_image_surface_get_format(image);
  if (cairo_surface_status(image) != CAIRO_STATUS_SUCCESS ||
      (format != CAIRO_FORMAT_RGB24 && format != CAIRO_FORMAT_ARGB32))
    throw ConfigError("{}: is no PNG image that can be read", file);
  GrayImage gray{cairo_image_surface_get_width(image), cairo_image_surface_get_height(image), 3 * 255, {}};
  for (int row = 0; row < gray.height; ++row) {
    const unsigned char* at =
        cairo_image_surface_get_data(image) + std::ptrdiff_t{row} * cairo_image_surface_get_stride(image);
    for (int column = 0; column < gray.width; ++column, at += 4) {
      std::uint32_t pixel = 0;
      std::memcpy(&pixel, at, sizeof pixel);
      if (format == CAIRO_FORMAT_ARGB32 && pixel >> 24 != 255)
        throw ConfigError(
            "{}: the pixel at column {}, row {} is not opaque; `convert IMAGE -background black -alpha remove map.png` "
            "of ImageMagick makes such cells occupied",
            file, column, row);
      gray.values.push_back(static_cast<std::uint16_t>((pixel >> 16 & 255) + (pixel >> 8 & 255) + (pixel & 255)));
    }
  }
  return gray;
}

GrayImage ReadPgm(const std::string& file, std::string_view bytes) { return PgmReader(file, bytes).Read(); }

World ReadOccupancyMap(const std::string& path, const MapOptions& options) try {
  const MapFile file = ReadMapFile(path);
  const std::string image_path = (std::filesystem::path(path).parent_path() / file.image).string();
  const std::string bytes = ReadWhole(image_path, 12 * kMaxPixels, fmt::format("{}: image: ", path));
  const bool is_png = bytes.starts_with("\x89PNG\r\n\x1a\n");
  const GrayImage image = is_png ? ReadPng(image_path, bytes) : ReadPgm(image_path, bytes);
  const OccupancyGrid::Map map = CellsOf(image, file, options);
  const auto grid = std::make_shared<const OccupancyGrid>(map);
  World world;
  if (!options.as_rectangles) world.Add(std::filesystem::path(path).stem().string(), Obstacle::Grid(grid));
  for (int block = 0; options.as_rectangles && block < std::ssize(grid->blocks()); ++block)
    world.Add(grid->cells(block).width > 0 ? "" : "beyond the map", grid->blocks()[ToSize(block)]);
  const auto occupied = std::ranges::count(map.occupied, true);
  world.notes.push_back(fmt::format("{} by {} cells of {} m, {} of them occupied.", map.width, map.height,
                                    ToText(map.resolution), occupied));
  if (occupied == std::ssize(map.occupied))
    world.notes.push_back(fmt::format(
        "No cell is free: check free_thresh ({}), negate and mode, and whether the image is an occupancy map.",
        ToText(file.free)));
  if (options.coarsen > 1)
    world.notes.push_back(fmt::format("{0} by {0} cells are occupied if one of them is.", options.coarsen));
  world.notes.push_back(options.unknown_is_free ? "Unknown cells are free, and so is all beyond the image."
                                                : "Unknown cells are occupied, and so is all beyond the image.");
  if (!options.unknown_is_free && (255 - 205) / 255.0 < file.free && file.mode == "trinary" && !file.is_negated)
    world.notes.push_back(
        "Gray 205, which map_saver writes for unknown cells, is unknown here; by the file's free_thresh it would be "
        "free.");
  if (file.mode == "raw") world.notes.push_back("Mode raw: what has a cost above 0 is occupied.");
  if (file.mode == "scale") world.notes.push_back("Mode scale: what is neither free nor occupied is occupied.");
  for (const std::string& key : file.unknown_keys)
    world.notes.push_back(fmt::format("Ignored: {} of the map's file.", key));
  return world;
} catch (const std::invalid_argument& error) {
  throw ConfigError("{}: {}", path, error.what());
}

}  // namespace forereach
