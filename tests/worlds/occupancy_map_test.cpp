// Maps of ROS: any bytes, and cells that are covered to the last bit.
#include "worlds/occupancy_map.h"

#include "forereach/safety/occupancy_grid.h"
#include "task/config_error.h"
#include "tests/test.h"
#include "tests/worlds/in_pieces.h"

namespace forereach::occupancy_map_test {

using namespace std::string_literals;

GrayImage Pgm(const std::string& bytes) { return ReadPgm("map.pgm", bytes); }
std::string Refusal(const std::string& bytes) {
  return Thrown<ConfigError>([&] { static_cast<void>(Pgm(bytes)); });
}

TEST(Pgm, IsReadInBothFormatsWithComments) {
  const std::vector<std::uint16_t> expected{0, 205, 254, 100, 7, 255};
  EXPECT_EQ(Pgm("P2 # a comment\n3\n# another\n2 255\n0 205 254\n100 7 255\n").values, expected);
  const GrayImage image = Pgm("P5\n# CREATOR: map_saver\n3 2\n255\n\x00\xcd\xfe\x64\x07\xff"s);
  EXPECT_FIELDS(image, (values, expected), (width, 3), (height, 2));
  EXPECT_EQ(Pgm("P5 1 2 65535 \x01\x02\xff\xff"s).values, (std::vector<std::uint16_t>{258, 65535}));
}

TEST(Pgm, RefusesWhatIsNoneAndAllocatesNothingForIt) {
  EXPECT_THAT(Refusal(""), HasSubstr("neither a PGM image"));
  EXPECT_THAT(Refusal("GIF89a"), HasSubstr("neither a PGM image"));
  EXPECT_THAT(Refusal("P5"), HasSubstr("no number where the width has to be"));
  EXPECT_THAT(Refusal("P5 # no end"), HasSubstr("no number"));
  EXPECT_THAT(Refusal("P5 99999999999999999999 1 255 "), HasSubstr("width is above"));
  EXPECT_THAT(Refusal("P5 60000000 60000000 255 "), HasSubstr("3600000000000000 pixels"));
  EXPECT_THAT(Refusal("P5 8000 8000 255 abc"), HasSubstr("cut off: 3 bytes of pixels, it has to have 64000000"));
  EXPECT_THAT(Refusal("P2 8000 8000 255 1 2"), HasSubstr("cut off"));
  EXPECT_THAT(Refusal("P5 2 1 65535 abc"), HasSubstr("cut off"));
  EXPECT_THAT(Refusal("P5 0 4 255 "), HasSubstr("no pixels"));
  EXPECT_THAT(Refusal("P5 1 1 65536 "), HasSubstr("largest value is above"));
  EXPECT_THAT(Refusal("P5 1 1 0 a"), HasSubstr("no pixels"));
  EXPECT_THAT(Refusal("P5 1 1 10 z"), HasSubstr("pixel 0 is 122, above the largest value 10"));
  EXPECT_THAT(Refusal("P2 2 1 10 3 -4"), HasSubstr("no number"));
  EXPECT_THAT(Refusal("P5 1 1 255"), HasSubstr("white space"));
  EXPECT_THAT(Refusal("P5 2 1 255\n# late\nab"), HasSubstr("at byte 13: 7 bytes behind the last pixel"));
  EXPECT_EQ(Pgm("P5 2 1 255 ab\r\n").values, (std::vector<std::uint16_t>{'a', 'b'}));
}

constexpr const char* kGrayPng =
    "iVBORw0KGgoAAAANSUhEUgAAAAMAAAACCAAAAAC4HznGAAAAEElEQVR4nGNgOPuP4d8/BgAOwgPIDrapNAAAAABJRU5E"
    "rkJggg==";
constexpr const char* kOpaquePng =
    "iVBORw0KGgoAAAANSUhEUgAAAAMAAAACCAYAAACddGYaAAAAHklEQVR4nGNgYGD4f/bs2f///v37zwAi/v4HMoCCANoU"
    "EVDWsJUMAAAAAElFTkSuQmCC";
constexpr const char* kTransparentPng =
    "iVBORw0KGgoAAAANSUhEUgAAAAMAAAACCAYAAACddGYaAAAAG0lEQVR4nGNgYGD4f/bsWYZ///79BxNgBlAQAMgnEFFn"
    "/lC/AAAAAElFTkSuQmCC";

std::string FromBase64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0, count = 0;
  for (const char c : text.substr(0, text.find('='))) {
    bits = bits << 6 | static_cast<unsigned>(kDigits.find(c));
    if ((count += 6) >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 255);
  }
  return bytes;
}

struct MapTest : testing::Test {
  static constexpr const char* kYaml =
      "image: map.pgm\nresolution: 0.1\norigin: [-0.3, 0.7, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
  // From the top: occupied, unknown, free; free, free, occupied.
  MapTest() { scratch_.Write("map.pgm", "P2 3 2 255 0 205 254 254 254 0"); }

  World Map(const std::string& yaml, const MapOptions& options = {}) {
    MapOptions as_rectangles = options;
    as_rectangles.as_rectangles = true;
    const std::string path = scratch_.Write("map.yaml", yaml);
    const World world = ReadOccupancyMap(path, as_rectangles);
    const Obstacle grid = ReadOccupancyMap(path, options).pieces.at(0).obstacle;
    EXPECT_EQ(grid.convex().size(), world.pieces.size());
    for (std::size_t i = 0; i < world.pieces.size(); ++i)
      EXPECT_EQ(grid.convex()[i].points(), world.pieces[i].obstacle.points());
    return world;
  }
  std::string WhyNot(const std::string& yaml) {
    return scratch_.Cut(Thrown<ConfigError>([&] { static_cast<void>(Map(yaml)); }));
  }
  static std::string With(const std::string& line) { return kYaml + line + "\n"; }
  static std::string Instead(const std::string& key, const std::string& line) {
    std::string yaml = kYaml;
    const std::size_t at = yaml.find(key);
    return yaml.replace(at, yaml.find('\n', at) - at, line);
  }
  // The middle of a cell, counted from the lower left.
  static ExactPoint Middle(int column, int row) {
    return {Rational(-0.3) + Rational(0.1) * Rational(column + 0.5),
            Rational(0.7) + Rational(0.1) * Rational(row + 0.5)};
  }

  ScratchDirectory scratch_;
};

TEST_F(MapTest, CellsStandWhereTheOriginSays) {
  const World world = Map(kYaml, {.unknown_is_free = true});
  EXPECT_EQ(world.pieces.size(), 2u);
  for (int column = -1; column < 4; ++column)
    for (int row = -1; row < 3; ++row)
      EXPECT_EQ(Contains(world, Middle(column, row)), (column == 0 && row == 1) || (column == 2 && row == 0))
          << column << ", " << row;
}

TEST_F(MapTest, UnknownCellsAndAllBeyondAreOccupied) {
  const World world = Map(kYaml);
  for (int column = -3; column < 9; ++column)
    for (int row = -3; row < 9; ++row) {
      const bool is_free = (row == 0 && (column == 0 || column == 1)) || (row == 1 && column == 2);
      EXPECT_EQ(Contains(world, Middle(column, row)), !is_free) << column << ", " << row;
    }
}

TEST_F(MapTest, CornersAreCoveredToTheLastBit) {
  const World world = Map(kYaml, {.unknown_is_free = true});
  const Rational left = Rational(-0.3) + 2 * Rational(0.1), low(0.7), side(0.1);
  for (const auto& [x, y] : {std::pair(left, low), {left + side, low}, {left + side, low + side}, {left, low + side}})
    EXPECT_TRUE(Contains(world, {x, y}));
}

TEST_F(MapTest, ATurnedMapCoversItsCells) {
  const World world = Map(Instead("origin", "origin: [-0.3, 0.7, 0.5]"));
  const Real cosine = cos(Real(0.5)), sine = sin(Real(0.5));
  // Each corner of an occupied cell is left of all sides of one polygon, or inside by 1e-30.
  const auto is_covered = [&](const Real& u, const Real& v) {
    const Real x = Real(-0.3) + cosine * u - sine * v, y = Real(0.7) + sine * u + cosine * v;
    return std::ranges::any_of(world.pieces, [&](const World::Piece& piece) {
      if (piece.obstacle.kind() == Obstacle::Kind::kHalfSpace) {
        const auto& normal = piece.obstacle.points()[0];
        return !(Real(normal[0]) * x + Real(normal[1]) * y < Real(piece.obstacle.offset()));
      }
      const Ring hull = CornersOf(piece.obstacle);
      for (std::size_t i = 0; i < hull.size(); ++i) {
        const PlanePoint &a = hull[i], &b = hull[(i + 1) % hull.size()];
        const Real turn = (Real(b.x) - Real(a.x)) * (y - Real(a.y)) - (Real(b.y) - Real(a.y)) * (x - Real(a.x));
        if (turn < Real(0)) return false;
      }
      return true;
    });
  };
  for (int column = -1; column < 4; ++column)
    for (int row = -1; row < 3; ++row) {
      const bool is_free = (row == 0 && (column == 0 || column == 1)) || (row == 1 && column == 2);
      const auto at = [&](double share_x, double share_y) {
        return is_covered(Real(0.1) * Real(column + share_x), Real(0.1) * Real(row + share_y));
      };
      EXPECT_EQ(at(0.5, 0.5), !is_free) << column << ", " << row;
      EXPECT_TRUE(is_free || (at(0, 0) && at(1, 0) && at(1, 1) && at(0, 1))) << column << ", " << row;
    }
}

TEST_F(MapTest, CoarserCellsCoverTheFineOnes) {
  const World world = Map(kYaml, {.unknown_is_free = true, .coarsen = 2});
  EXPECT_EQ(world.pieces.size(), 1u) << "both blocks are occupied";
  EXPECT_TRUE(Contains(world, Middle(0, 0)) && Contains(world, Middle(1, 1)) && Contains(world, Middle(2, 0)));
  EXPECT_TRUE(Contains(Map(kYaml, {.coarsen = 5}), Middle(4, 1))) << "beyond the image, in the last coarse cell";
}

TEST_F(MapTest, NegatedAndScaledMaps) {
  const World negated = Map(Instead("negate", "negate: 1"), {.unknown_is_free = true});
  EXPECT_TRUE(Contains(negated, Middle(0, 0)) && !Contains(negated, Middle(0, 1)));
  const World scaled = Map(With("mode: scale"), {.unknown_is_free = true});
  EXPECT_TRUE(Contains(scaled, Middle(1, 1))) << "205 is between the thresholds";
  EXPECT_THAT(Map(Instead("free_thresh", "free_thresh: 0")).notes,
              Contains(StartsWith("No cell is free: check free_thresh (0),")));
  EXPECT_THAT(Map(kYaml).notes, Not(Contains(StartsWith("No cell"))));
}

TEST_F(MapTest, OfARawMapWhatHasACostIsOccupied) {
  scratch_.Write("map.pgm", "P2 3 2 255 0 1 100 0 255 0");
  const World world = Map(With("mode: raw"), {.unknown_is_free = true});
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 2; ++row)
      EXPECT_EQ(Contains(world, Middle(column, row)), row == 1 ? column > 0 : column == 1) << column << ", " << row;
  EXPECT_THAT(WhyNot(Instead("negate", "negate: 1\nmode: raw")), HasSubstr("map.yaml:4: negate: has no one meaning"));
}

// Its own free_thresh, 0.25, would take 205 for free.
TEST_F(MapTest, WhatMapSaverWritesForUnknownIsUnknown) {
  const std::string yaml = Instead("free_thresh", "free_thresh: 0.25");
  const World world = Map(yaml);
  EXPECT_TRUE(Contains(world, Middle(1, 1)));
  EXPECT_THAT(world.notes, Contains(StartsWith("Gray 205")));
  EXPECT_FALSE(Contains(Map(yaml, {.unknown_is_free = true}), Middle(1, 1)));
  EXPECT_THAT(Map(kYaml).notes, Not(Contains(StartsWith("Gray 205"))));
}

// The same cells as map.pgm, in gray and in colours.
TEST_F(MapTest, APngImageIsRead) {
  const std::string yaml = Instead("image", "image: map.png");
  const auto write = [&](const char* base64) { scratch_.Write("map.png", FromBase64(base64)); };
  write(kGrayPng);
  const World world = Map(yaml), same = Map(kYaml);
  EXPECT_EQ(world.pieces.size(), same.pieces.size());
  for (int column = -2; column < 5; ++column)
    for (int row = -2; row < 4; ++row)
      EXPECT_EQ(Contains(world, Middle(column, row)), Contains(same, Middle(column, row))) << column << ", " << row;
  write(kOpaquePng);
  EXPECT_EQ(Map(yaml).pieces.size(), same.pieces.size());
  write(kTransparentPng);
  EXPECT_THAT(WhyNot(yaml), HasSubstr("map.png: the pixel at column 1, row 0 is not opaque"));
  const std::string whole = FromBase64(kGrayPng);
  scratch_.Write("map.png", whole.substr(0, whole.size() - 30));
  EXPECT_THAT(WhyNot(yaml), HasSubstr("map.png: is no PNG image that can be read"));
  scratch_.Write("map.png", whole.substr(0, 16) + std::string(8, '\x7f') + whole.substr(24));
  EXPECT_THAT(WhyNot(yaml), HasSubstr("more than 67108864 pixels"));
  scratch_.Write("map.png", whole.substr(0, 20));
  EXPECT_THAT(WhyNot(yaml), HasSubstr("has no size"));
  std::string other = whole;
  scratch_.Write("map.png", other.replace(12, 4, "tEXt"));
  EXPECT_THAT(WhyNot(yaml), HasSubstr("has no size")) << "another chunk comes before it";
  std::string deep = whole;
  deep[24] = 16;
  scratch_.Write("map.png", deep);
  EXPECT_THAT(WhyNot(yaml), HasSubstr("map.png: has 16 bits a channel"));
}

TEST_F(MapTest, WhatTheFileLacksIsSaid) {
  EXPECT_THAT(WhyNot(Instead("resolution", "resolution: 0")), HasSubstr("map.yaml:2: resolution: 0 is outside"));
  EXPECT_THAT(WhyNot(Instead("resolution", "")), HasSubstr("resolution: missing"));
  EXPECT_THAT(WhyNot(Instead("origin", "origin: [0]")), HasSubstr("has to have x, y and yaw"));
  EXPECT_THAT(WhyNot(Instead("free_thresh", "free_thresh: 0.9")), HasSubstr("is above occupied_thresh"));
  EXPECT_THAT(WhyNot(Instead("image", "image: none.pgm")), HasSubstr("none.pgm"));
  EXPECT_THAT(WhyNot("[]"), HasSubstr("is not a map"));
  EXPECT_THAT(Map(With("author: someone")).notes, Contains("Ignored: author of the map's file."));
}

}  // namespace forereach::occupancy_map_test
