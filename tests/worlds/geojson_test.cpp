// Drawings in GeoJSON.
#include "worlds/geojson.h"

#include <fmt/format.h>

#include "task/config_error.h"
#include "tests/test.h"
#include "tests/worlds/in_pieces.h"

namespace forereach::geojson_test {

struct GeoJsonTest : testing::Test {
  World Drawing(const std::string& text, const GeoJsonOptions& options = {.are_metres = true}) {
    return ReadGeoJson(scratch_.Write("site.geojson", text), options);
  }
  std::string WhyNot(const std::string& text, const GeoJsonOptions& options = {.are_metres = true}) {
    return scratch_.Cut(Thrown<ConfigError>([&] { static_cast<void>(Drawing(text, options)); }));
  }
  static std::string Feature(const std::string& geometry, const std::string& properties = "null") {
    return R"({"type": "FeatureCollection", "features": [{"type": "Feature", "properties": )" + properties +
           R"(, "geometry": )" + geometry + "}]}";
  }
  static ExactPoint At(double x, double y) { return ToExact({x, y}); }

  // A square with an L out of it, and a hole.
  static constexpr const char* kArea =
      R"({"type": "Polygon", "coordinates": [[[0,0],[8,0],[8,8],[6,8],[6,2],[0,2],[0,0]], [[6.5,1],[7,1],[7,1.5],[6.5,1]]]})";
  ScratchDirectory scratch_;
};

TEST_F(GeoJsonTest, AnAreaToKeepOutOfIsExact) {
  const World world = Drawing(Feature(kArea));
  EXPECT_TRUE(Contains(world, At(1, 1)) && Contains(world, At(7, 7)) && Contains(world, At(8, 8)));
  EXPECT_FALSE(Contains(world, At(1, 3)) || Contains(world, At(6.8, 1.1)) || Contains(world, At(8.0000000001, 7)));
  EXPECT_EQ(world.pieces.front().name, "features[0].geometry");
  const World by_id =
      Drawing(std::string(R"({"type": "Feature", "id": 42, "properties": {}, "geometry": )") + kArea + "}");
  EXPECT_EQ(by_id.pieces.front().obstacle.name(), "feature_42");
  EXPECT_EQ(Drawing(Feature(kArea, R"({"name": "big oak <3>"})")).pieces.front().obstacle.name(), "big_oak__3_");
}

TEST_F(GeoJsonTest, OutsideOfAnAreaToStayInIsOccupied) {
  for (const World& world : {Drawing(Feature(kArea, R"({"keep_in": true, "name": "yard"})")),
                             Drawing(kArea, {.are_metres = true, .keep_in = true})}) {
    EXPECT_FALSE(Contains(world, At(1, 1)) || Contains(world, At(7, 7)));
    for (const auto& [x, y] : {std::pair(1.0, 3.0), {6.8, 1.1}, {9, 9}, {-5, 1}, {100, 1}, {1, -1e6}, {0, 1}})
      EXPECT_TRUE(Contains(world, At(x, y))) << x << ", " << y;
  }
}

TEST_F(GeoJsonTest, OfTwoAreasToStayInTheUnionCounts) {
  const std::string both =
      R"({"type": "MultiPolygon", "coordinates": [[[[0,0],[2,0],[2,2],[0,2]]], [[[5,0],[7,0],[7,2],[5,2]]]]})";
  const World world = Drawing(both, {.are_metres = true, .keep_in = true});
  EXPECT_FALSE(Contains(world, At(1, 1)) || Contains(world, At(6, 1)));
  EXPECT_TRUE(Contains(world, At(3.5, 1)));
}

TEST_F(GeoJsonTest, TextsOfOtherMapsAreReadAsNumbersWhereTheyCount) {
  constexpr const char* kLine = R"({"type": "LineString", "coordinates": [[0,0],[4,0]]})";
  EXPECT_TRUE(Contains(Drawing(Feature(kLine, R"({"width": "3"})")), At(2, 1.5)));
  EXPECT_THAT(WhyNot(Feature(kLine, R"({"width": "3 m"})")), HasSubstr("properties.width: '3 m'"));
  EXPECT_FALSE(Drawing(Feature(kArea, R"({"width": "wide", "radius": "?"})")).pieces.empty());
  EXPECT_THAT(WhyNot(R"({"type": "Topology", "objects": {}})"), HasSubstr("type Topology is none of GeoJSON's"));
}

TEST_F(GeoJsonTest, LinesAndPointsHaveASize) {
  const World world = Drawing(
      R"({"type": "GeometryCollection", "geometries": [{"type": "LineString", "coordinates": [[0,0,9],[3,4]]},
          {"type": "MultiPoint", "coordinates": [[10,0],[20,0]]}]})",
      {.are_metres = true, .line_width = 1, .point_radius = 2});
  EXPECT_EQ(world.pieces.size(), 3u);
  EXPECT_TRUE(Contains(world, At(-0.3, -0.4)) && Contains(world, At(1.5 - 0.4, 2 + 0.3)) && Contains(world, At(12, 0)));
  EXPECT_FALSE(Contains(world, At(-1, 0)) || Contains(world, At(12.1, 0)));
  EXPECT_TRUE(
      Contains(Drawing(Feature(R"({"type": "Point", "coordinates": [1, 1]})", R"({"radius": 0.5})")), At(1.5, 1)));
  EXPECT_THAT(WhyNot(R"({"type": "Point", "coordinates": [1, 1]})"), HasSubstr("coordinates: has no radius"));
  EXPECT_THAT(WhyNot(R"({"type": "LineString", "coordinates": [[1, 1], [2, 2]]})"), HasSubstr("has no width"));
}

// 0.001 degrees are 111.3 m of the equator, and 110.6 m of a meridian there.
TEST_F(GeoJsonTest, DegreesAreMetresEastAndNorthOfTheOrigin) {
  const std::string square =
      R"({"type": "Polygon", "coordinates": [[[179.999,0.001],[180,0.001],[180,0.002],[179.999,0.002]]]})";
  const World world = Drawing(square, {.origin = PlanePoint{180, 0}});
  const Obstacle& box = Only(world.pieces).obstacle;
  EXPECT_NEAR(box.lower().x(), -111.3195, 1e-3);
  EXPECT_NEAR(box.lower().y(), 110.5743, 2e-3);
  EXPECT_THAT(world.notes, Contains(HasSubstr("tangent plane")));
}

// A side along a parallel is straight in degrees and bends in the plane.
TEST_F(GeoJsonTest, SidesThatAreStraightInDegreesAreCovered) {
  const std::string strip =
      R"({"type": "Polygon", "coordinates": [[[0.0,60.0],[0.02,60.0],[0.02,60.0001],[0.0,60.0001]]]})";
  const World world = Drawing(strip, {.origin = PlanePoint{0, 60}});
  for (int i = 0; i <= 20; ++i) {
    const std::string here =
        fmt::format(R"({{"type": "Polygon", "coordinates": [[[{0},60.0],[{0},60.00000001],[{1},60.0]]]}})", 0.001 * i,
                    0.001 * i + 1e-9);
    const World point = Drawing(here, {.origin = PlanePoint{0, 60}});
    const Eigen::Vector3d middle = (point.pieces[0].obstacle.lower() + point.pieces[0].obstacle.upper()) / 2;
    EXPECT_TRUE(Contains(world, At(middle.x(), middle.y()))) << i;
  }
}

TEST_F(GeoJsonTest, WhatLooksLikeDegreesNeedsAWord) {
  const std::string place = R"({"type": "Polygon", "coordinates": [[[11.58,48.14],[11.59,48.14],[11.59,48.15]]]})";
  EXPECT_THAT(WhyNot(place, {}), HasSubstr("look like degrees; give --origin LON,LAT"));
  EXPECT_THAT(WhyNot(place, {.origin = PlanePoint{12, 48}}), HasSubstr("more than 10000 m from the origin"));
  EXPECT_THAT(WhyNot(place, {.origin = PlanePoint{-168.41, -48.14}}), HasSubstr("more than 10000 m"))
      << "the other side";
  EXPECT_EQ(Drawing(place).pieces.size(), 1u);
}

// Metres of Web Mercator are larger than those of the ground: obstacles would stand too far away.
TEST_F(GeoJsonTest, WhatTheCoordinatesAreIsReadWhereTheFileSaysIt) {
  const auto with_crs = [](const std::string& crs) {
    return R"({"type": "Polygon", "coordinates": [[[0,0],[8,0],[8,8]]], "crs": )" + crs + "}";
  };
  const auto named = [&](const std::string& name) {
    return with_crs(R"({"type": "name", "properties": {"name": ")" + name + "\"}}");
  };
  EXPECT_THAT(WhyNot(named("urn:ogc:def:crs:EPSG::3857"), {}), HasSubstr("is Web Mercator"));
  EXPECT_THAT(WhyNot(named("EPSG:900913"), {.origin = PlanePoint{0, 0}}), HasSubstr("ogr2ogr"));
  EXPECT_THAT(WhyNot(with_crs("\"EPSG:3857\""), {}), HasSubstr("give --metres"));
  for (const char* degrees : {"urn:ogc:def:crs:OGC:1.3:CRS84", "EPSG:4326"})
    EXPECT_THAT(WhyNot(named(degrees), {}), HasSubstr("look like degrees")) << "eight of them are no metres";
  EXPECT_THAT(Drawing(named("EPSG:32632"), {}).notes, Contains(HasSubstr("with the crs EPSG:32632")));
  EXPECT_THAT(ObstaclesText(Drawing(named("a\\ntask: 1"), {}), "any"), Not(HasSubstr("\ntask: 1")));
  for (const char* none : {"null", "[1]", R"({"properties": 3})"})
    EXPECT_TRUE(Drawing(with_crs(none), {}).notes.empty());
}

// An editor of routes calls a map's own metres Web Mercator. Near zero they are metres; farther away nothing says so.
TEST_F(GeoJsonTest, MetresOfAMapMayBeCalledWebMercatorNearZeroAlone) {
  const auto at = [](const std::string& x) {
    return R"({"type": "Polygon", "crs": "EPSG:3857", "coordinates": [[[0,0],[)" + x + ",0],[8,8]]]}";
  };
  GeoJsonOptions metres;
  metres.are_metres = true;
  EXPECT_THAT(Drawing(at("10000"), metres).notes,
              Contains(HasSubstr("taken as metres of a plane, with the crs EPSG:3857")));
  EXPECT_THAT(WhyNot(at("10001"), metres), HasSubstr("farther than 10000 m, where metres of Web Mercator"));
  metres.origin = PlanePoint{0, 0};
  EXPECT_THAT(WhyNot(at("8"), metres), HasSubstr("is Web Mercator"));
}

TEST_F(GeoJsonTest, RefusesWhatIsNoneWithThePlace) {
  EXPECT_THAT(WhyNot("{"), HasSubstr("site.geojson: is no JSON"));
  EXPECT_THAT(WhyNot("{}"), HasSubstr("has no type"));
  EXPECT_THAT(WhyNot(R"({"type": "Sphere", "coordinates": []})"), HasSubstr("type Sphere is none"));
  EXPECT_THAT(WhyNot(R"({"type": "Polygon", "coordinates": []})"), HasSubstr("has no ring"));
  EXPECT_THAT(WhyNot(R"({"type": "Polygon", "coordinates": [[[0,0],[4,4],[4,0],[0,4]]]})"),
              HasSubstr("coordinates: the side from (0, 0) to (4, 4) meets"));
  EXPECT_THAT(WhyNot(R"({"type": "Point", "coordinates": ["a", 1]})"), HasSubstr("coordinates[0]"));
  EXPECT_THAT(WhyNot(R"({"type": "Point", "coordinates": [1e10, 1]})"), HasSubstr("farther than"));
  EXPECT_THAT(WhyNot(R"({"type": "Point", "coordinates": [1]})"), HasSubstr("two or three"));
  EXPECT_THAT(WhyNot(Feature(R"({"type": "Point", "coordinates": [1, 1]})", R"({"radius": -1})")), HasSubstr("radius"));
  EXPECT_THAT(WhyNot(Feature(kArea, R"({"keep_in": "yes"})")), HasSubstr("neither true nor false"));
  EXPECT_THAT(Drawing(Feature("null")).pieces, IsEmpty());
}

}  // namespace forereach::geojson_test
