// Scenarios of CommonRoad: what a vehicle covers at any time between two of its states is in the world then.
#include "worlds/commonroad.h"

#include <regex>

#include <fmt/format.h>

#include "task/config_error.h"
#include "tests/oracle/traced_random.h"
#include "tests/test.h"
#include "tests/worlds/in_pieces.h"

namespace forereach::commonroad_test {

std::string Bound(const std::vector<PlanePoint>& points) {
  std::string text;
  for (const auto& [x, y] : points) text += fmt::format("<point><x>{}</x><y>{}</y></point>", x, y);
  return text;
}

std::string Lanelet(int id, const std::vector<PlanePoint>& left, const std::vector<PlanePoint>& right,
                    const std::string& more = "") {
  return fmt::format("<lanelet id=\"{}\"><leftBound>{}</leftBound><rightBound>{}</rightBound>{}</lanelet>\n", id,
                     Bound(left), Bound(right), more);
}

std::string Exact(const char* name, double value) { return fmt::format("<{0}><exact>{1}</exact></{0}>", name, value); }
std::string Between(const char* name, double lower, double upper) {
  return fmt::format("<{0}><intervalStart>{1}</intervalStart><intervalEnd>{2}</intervalEnd></{0}>", name, lower, upper);
}

std::string State(const char* name, double x, double y, double yaw, int step) {
  return fmt::format("<{0}><position><point><x>{1}</x><y>{2}</y></point></position>{3}{4}</{0}>", name, x, y,
                     Exact("orientation", yaw), Exact("time", step));
}

constexpr const char* kCar = "<shape><rectangle><length>4</length><width>2</width></rectangle></shape>";

struct CommonRoadTest : testing::Test {
  World Scenario(const std::string& content, const CommonRoadOptions& options = {}) {
    return ReadCommonRoad(scratch_.Write("scenario.xml", kHead + content + "</commonRoad>\n"), options);
  }
  std::string WhyNot(const std::string& content) {
    return scratch_.Cut(Thrown<ConfigError>([&] { static_cast<void>(Scenario(content)); }));
  }
  static ExactPoint At(double x, double y) { return ToExact({x, y}); }

  std::string kHead = "<?xml version='1.0'?>\n<commonRoad timeStepSize=\"0.1\" commonRoadVersion=\"2020a\">\n";
  ScratchDirectory scratch_;
};

TEST_F(CommonRoadTest, TheBoundaryIsWhereNoNeighbourIs) {
  const World world =
      Scenario(Lanelet(1, {{0, 4}, {10, 4}, {20, 4}}, {{0, 0}, {10, 0}, {20, 1}},
                       "<adjacentLeft ref=\"2\" drivingDir=\"same\"/>") +
               Lanelet(2, {{0, 8}, {20, 8}}, {{0, 4}, {20, 4}},
                       "<adjacentLeft ref=\"7\" drivingDir=\"same\"/><adjacentRight ref=\"1\" drivingDir=\"same\"/>"));
  EXPECT_TRUE(Contains(world, At(5, 0)) && Contains(world, At(20, 1)) && Contains(world, At(15, 8)))
      << "lanelet 7 does not exist";
  EXPECT_FALSE(Contains(world, At(5, 4)) || Contains(world, At(5, 0.01)));
  EXPECT_EQ(world.pieces.size(), 3u);
}

TEST_F(CommonRoadTest, BetweenNeighboursThatAreApartAndBeyondTheEndOfOneIsNoRoad) {
  const auto road = [this](double gap, double end, const std::string& neighbour = "2") {
    return Scenario(Lanelet(1, {{0, 4}, {20, 4}, {40, 4}}, {{0, 0}, {40, 0}},
                            "<adjacentLeft ref=\"" + neighbour + "\" drivingDir=\"opposite\"/>") +
                    Lanelet(2, {{end, 4 + gap}, {7, 4 + gap}, {0, 4 + gap}}, {{end, 8}, {0, 8}},
                            "<adjacentLeft ref=\"1\" drivingDir=\"opposite\"/>"));
  };
  EXPECT_EQ(road(0, 40).pieces.size(), 2u);
  EXPECT_EQ(road(0.1, 40).pieces.size(), 2u) << "files round";
  const World median = road(0.11, 40), shorter = road(0, 20), itself = road(0, 40, "1");
  EXPECT_TRUE(Contains(median, At(10, 4)) && Contains(median, At(30, 4)));
  EXPECT_TRUE(Contains(median, {Rational(10), Rational(4 + 0.11)}));
  EXPECT_TRUE(Contains(shorter, At(30, 4)) && !Contains(shorter, At(10, 4)));
  EXPECT_TRUE(Contains(itself, At(10, 4)));
}

TEST_F(CommonRoadTest, In2018bTheRoleOfAnObstacleIsAnElement) {
  kHead = "<commonRoad timeStepSize=\"0.1\" commonRoadVersion=\"2018b\">\n";
  const World world = Scenario(
      std::string("<obstacle id=\"1\"><role>static</role><type>car</type>") + kCar + State("initialState", 0, 0, 0, 0) +
      "</obstacle><obstacle id=\"2\"><role> dynamic </role>" + kCar + State("initialState", 20, 0, 0, 0) +
      "<trajectory>" + State("state", 30, 0, 0, 1) + "</trajectory></obstacle>");
  ASSERT_EQ(world.pieces.size(), 2u);
  EXPECT_EQ(world.pieces[0].name, "staticObstacle 1");
  EXPECT_TRUE(world.pieces[1].window && Contains(world, At(25, 0), 0.05));
  EXPECT_THAT(WhyNot("<obstacle id=\"1\"/>"), HasSubstr("obstacle: has no role"));
  EXPECT_THAT(WhyNot("<obstacle id=\"1\"><role>dark</role></obstacle>"), HasSubstr("no kind of obstacle"));
}

TEST_F(CommonRoadTest, SegmentsNearTheirChordAreOnePiece) {
  std::vector<PlanePoint> left, right;
  for (int i = 0; i <= 40; ++i) {
    left.push_back({i / 2.0, 4 + 0.0005 * i * i});
    right.push_back({i / 2.0, 0.0005 * i * i});
  }
  const World exact = Scenario(Lanelet(1, left, right), {.thickness = 0}),
              thin = Scenario(Lanelet(1, left, right), {.thickness = 0.05});
  EXPECT_EQ(exact.pieces.size(), 80u);
  EXPECT_LT(thin.pieces.size(), 12u);
  for (std::size_t i = 0; i + 1 < left.size(); ++i)
    EXPECT_TRUE(Contains(thin, {(Rational(left[i].x) + Rational(left[i + 1].x)) / 2,
                                (Rational(left[i].y) + Rational(left[i + 1].y)) / 2}));
}

// Two roads cross: their bounds are open where the other road is.
TEST_F(CommonRoadTest, ACrossingIsOpen) {
  const std::vector<PlanePoint> low{{-20, -2}, {-2, -2}, {2, -2}, {20, -2}}, high{{-20, 2}, {-2, 2}, {2, 2}, {20, 2}};
  std::vector<PlanePoint> west, east;
  for (const auto& [x, y] : low) west.push_back({y, x}), east.push_back({-y, x});
  const World world = Scenario(Lanelet(1, high, low) + Lanelet(2, west, east));
  EXPECT_FALSE(Contains(world, At(0, 2)) || Contains(world, At(2, 0)) || Contains(world, At(0, -2)));
  EXPECT_TRUE(Contains(world, At(-10, 2)) && Contains(world, At(2, 10)) && Contains(world, At(10, -2)));
  EXPECT_THAT(world.notes, Contains(HasSubstr("4 segments are left out where they lie inside another lanelet")));
}

// A straight road of two points a side, and a side road that turns into it: what lies in the turn is road.
TEST_F(CommonRoadTest, ABoundIsOpenAsFarAsAnotherLaneletGoes) {
  const World world = Scenario(Lanelet(1, {{-20, 2}, {20, 2}}, {{-20, -2}, {20, -2}}) +
                               Lanelet(2, {{-3, 9}, {-3, 0}}, {{4, 9}, {4, 0}}));
  EXPECT_FALSE(Contains(world, At(-2.9, 2)) || Contains(world, At(0, 2)) || Contains(world, At(3.9, 2)));
  for (const double x : {-20.0, -10.0, -3.0, 4.0, 20.0}) EXPECT_TRUE(Contains(world, At(x, 2))) << x;
  for (const double x : {-20.0, 0.0, 3.0, 20.0}) EXPECT_TRUE(Contains(world, At(x, -2))) << x;
  for (const double x : {-3.0, 4.0}) {
    EXPECT_TRUE(Contains(world, At(x, 9)) && Contains(world, At(x, 2))) << x;
    EXPECT_FALSE(Contains(world, At(x, 1.9)) || Contains(world, At(x, 0.1))) << x;
  }
  EXPECT_THAT(world.notes, Contains(HasSubstr("3 segments are left out where they lie inside another lanelet")));
}

// Nobody drives off the road along a crosswalk, from a bridge or onto a cycle lane.
TEST_F(CommonRoadTest, ABoundStaysUnderALaneletThatIsNoRoadForIt) {
  const std::string road = Lanelet(1, {{-20, 2}, {20, 2}}, {{-20, -2}, {20, -2}});
  const auto crossed_by = [&](const std::string& type) {
    return Scenario(road + Lanelet(2, {{-3, 9}, {-3, -9}}, {{4, 9}, {4, -9}}, type));
  };
  EXPECT_FALSE(Contains(crossed_by("<laneletType>urban</laneletType>"), At(0, 2)));
  for (const std::string type : {"crosswalk", "sidewalk", "bicycleLane"}) {
    const World world = crossed_by("<laneletType>urban</laneletType><laneletType> " + type + " </laneletType>");
    EXPECT_TRUE(Contains(world, At(0, 2)) && Contains(world, At(0, -2))) << type;
    EXPECT_FALSE(Contains(world, At(-3, 0))) << "its own bounds do not close the road";
    EXPECT_THAT(world.notes, Contains(HasSubstr("1 lanelets are sidewalk, crosswalk, bicycleLane: no road")));
  }
  for (const double z : {0.0, 0.5, 6.0}) {
    const std::string bridge = std::regex_replace(Lanelet(2, {{-3, 9}, {-3, -9}}, {{4, 9}, {4, -9}}),
                                                  std::regex("</point>"), fmt::format("<z>{}</z></point>", z));
    EXPECT_EQ(Contains(Scenario(road + bridge), At(0, 2)), z > 0) << z;
  }
  const World beside =
      Scenario(Lanelet(1, {{0, 4}, {40, 4}}, {{0, 0}, {40, 0}}, "<adjacentLeft ref=\"2\" drivingDir=\"same\"/>") +
               Lanelet(2, {{0, 6}, {40, 6}}, {{0, 4}, {40, 4}}, "<laneletType>bicycleLane</laneletType>"));
  EXPECT_TRUE(Contains(beside, At(10, 4)));
}

TEST_F(CommonRoadTest, WhatStandsIsItsShapeAtItsState) {
  const World world = Scenario(std::string("<staticObstacle id=\"3\"><type>car</type>") + kCar +
                               State("initialState", 10, 5, std::numbers::pi / 2, 0) + "</staticObstacle>");
  EXPECT_TRUE(Contains(world, At(10, 7)) && Contains(world, At(9.0000001, 3.0000001)));
  EXPECT_FALSE(Contains(world, At(12, 5)) || Contains(world, At(10, 7.0001)));
  EXPECT_EQ(world.pieces[0].name, "staticObstacle 3");
  EXPECT_EQ(world.pieces[0].obstacle.name(), "staticObstacle_3");
  EXPECT_THAT(ObstaclesText(world, "any"), HasSubstr("  # staticObstacle 3\n      name: staticObstacle_3\n"));
}

// As of a point mass: on each of these ways, looking anywhere, a corner may be anywhere around the position.
TEST_F(CommonRoadTest, AStateWithoutOrientationIsCoveredWhicheverWayItLooks) {
  const auto state = [](const char* name, double x, int step) {
    return fmt::format("<{0}><position><point><x>{1}</x><y>0</y></point></position>{2}</{0}>", name, x,
                       Exact("time", step));
  };
  const std::string car = std::string("<dynamicObstacle id=\"1\">") + kCar;
  const World world = Scenario(car + State("initialState", 0, 0, 0, 0) + "<trajectory>" + state("state", 10, 1) +
                               state("state", 20, 2) + "</trajectory></dynamicObstacle>");
  EXPECT_THAT(world.notes, Contains(HasSubstr("2 states have no orientation")));
  for (TracedRandom random(1); random.Again(500);) {
    const double along = random.Uniform(0, 2), yaw = random.Uniform(-4, 4);
    // From the first state on it turns evenly.
    const double turned = along < 1 ? along * std::remainder(yaw, 2 * std::numbers::pi) : yaw;
    for (const double u : {-2.0, 2.0})
      for (const double v : {-1.0, 1.0}) {
        const double x = 10 * along + std::cos(turned) * u - std::sin(turned) * v,
                     y = std::sin(turned) * u + std::cos(turned) * v;
        EXPECT_TRUE(Contains(world, At(x, y), 0.1 * along)) << along << " " << turned;
      }
  }
  EXPECT_FALSE(Contains(world, At(20, 2.3), 0.2)) << "the disc's radius is sqrt(5)";
  EXPECT_TRUE(Contains(Scenario("<staticObstacle id=\"1\"><shape><circle><radius>1</radius><center><x>3</x><y>0</y>"
                                "</center></circle></shape>" +
                                state("initialState", 0, 0) + "</staticObstacle>"),
                       At(0, -3.99)))
      << "a circle beside its origin turns, too";
}

TEST_F(CommonRoadTest, ASetThatBeginsWithTheInitialStateIsTakenWithIt) {
  const auto occupancy = [](double x, int step) {
    return fmt::format(
        "<occupancy><shape><circle><radius>1</radius><center><x>{}</x><y>0</y></center></circle></shape>"
        "{}</occupancy>",
        x, Exact("time", step));
  };
  const std::string car = std::string("<dynamicObstacle id=\"1\">") + kCar + State("initialState", 0, 0, 0, 0);
  const World world =
      Scenario(car + "<occupancySet>" + occupancy(5, 0) + occupancy(9, 1) + "</occupancySet></dynamicObstacle>");
  EXPECT_TRUE(Contains(world, At(-2, 1), 0) && Contains(world, At(5.9, 0), 0) && Contains(world, At(9.9, 0), 0.1));
  EXPECT_THAT(WhyNot(car + "<occupancySet>" + occupancy(5, -1) + "</occupancySet></dynamicObstacle>"),
              HasSubstr("not in the order of time"));
}

TEST_F(CommonRoadTest, IntervalsOfAStateAreCovered) {
  const World world =
      Scenario(std::string("<staticObstacle id=\"3\">") + kCar +
               "<initialState><position><rectangle><length>2</length><width>1</width><center><x>10</x><y>5</y></center>"
               "</rectangle></position>" +
               Between("orientation", -0.2, 0.3) + "</initialState></staticObstacle>");
  for (const double yaw : {-0.2, 0.0, 0.3})
    for (const double x : {9.0, 11.0})
      for (const double y : {4.5, 5.5})
        for (const auto& [along, across] : {std::pair(2, 1), {-2, 1}, {2, -1}, {-2, -1}})
          EXPECT_TRUE(Contains(world, At(x + along * std::cos(yaw) - across * std::sin(yaw),
                                         y + along * std::sin(yaw) + across * std::cos(yaw))));
}

// The center on a straight line, an even turn: corners and middles of the sides at any time.
TEST_F(CommonRoadTest, MotionBetweenStatesIsCovered) {
  FreshRandom random;
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int round = 0; round < 20; ++round) {
    struct Pose {
      double x, y, yaw;
    };
    std::vector<Pose> poses;
    std::string states;
    for (int i = 0; i < 6; ++i) {
      poses.push_back({3.0 * i + unit(random), unit(random), 3.1 + 0.8 * unit(random)});
      const double wrapped = std::remainder(poses[i].yaw, 2 * std::numbers::pi);
      states +=
          State(i == 0 ? "initialState" : "state", poses[i].x, poses[i].y, wrapped, i) + (i == 0 ? "<trajectory>" : "");
    }
    const World world =
        Scenario(std::string("<dynamicObstacle id=\"1\">") + kCar + states + "</trajectory></dynamicObstacle>",
                 {.steps_per_window = 1 + round % 3});
    EXPECT_LE(world.pieces.size(), 5u);
    for (int k = 0; k <= 500; ++k) {
      const double s = k % 100 / 100.0;
      const auto i = static_cast<std::size_t>(std::min(4, k / 100));
      const Pose &a = poses[i], &b = poses[i + 1];
      const double x = a.x + s * (b.x - a.x), y = a.y + s * (b.y - a.y), yaw = a.yaw + s * (b.yaw - a.yaw);
      const double time = 0.1 * (static_cast<double>(i) + s);
      for (const auto& [along, across] : {std::pair(2, 1), {-2, 1}, {2, -1}, {-2, -1}, {0, 1}, {2, 0}})
        EXPECT_TRUE(Contains(
            world,
            At(x + along * std::cos(yaw) - across * std::sin(yaw), y + along * std::sin(yaw) + across * std::cos(yaw)),
            time));
    }
  }
}

TEST_F(CommonRoadTest, OccupancySetsAndShapesOfSeveralParts) {
  const auto occupancy = [](double x, const std::string& time) {
    return fmt::format(
        "<occupancy><shape><circle><radius>1</radius><center><x>{}</x><y>0</y></center></circle></shape>{}"
        "</occupancy>",
        x, time);
  };
  const World world = Scenario(std::string("<dynamicObstacle id=\"1\">") + kCar + State("initialState", 0, 0, 0, 0) +
                               "<occupancySet>" + occupancy(3, Between("time", 1, 2)) + occupancy(9, Exact("time", 3)) +
                               "</occupancySet></dynamicObstacle>" + "<phantomObstacle id=\"2\"><occupancySet>" +
                               occupancy(50, Between("time", 0, 5)) + "</occupancySet></phantomObstacle>");
  EXPECT_TRUE(Contains(world, At(3, 1), 0.15) && Contains(world, At(6, 1), 0.25) && Contains(world, At(50, 0), 0.5));
  EXPECT_FALSE(Contains(world, At(3, 0), 0.35) || Contains(world, At(9, 0), 0.05) || Contains(world, At(50, 0), 0.6));
  EXPECT_THAT(world.notes, Contains(HasSubstr("The first prediction ends at 0.3 s")));
}

TEST_F(CommonRoadTest, WithoutAPredictionItStands) {
  const World world =
      Scenario(std::string("<dynamicObstacle id=\"1\">") + kCar + State("initialState", 0, 0, 0, 0) +
               "</dynamicObstacle><environmentObstacle id=\"9\"><shape><polygon>" +
               Bound({{10, 0}, {14, 0}, {14, 4}, {13, 1}}) + "</polygon></shape></environmentObstacle>");
  EXPECT_TRUE(Contains(world, At(0, 0), 100) && Contains(world, At(12, 0.1)));
  EXPECT_FALSE(Contains(world, At(12.5, 1.5))) << "the polygon is not convex";
  EXPECT_THAT(world.notes, Contains(HasSubstr("No prediction of dynamicObstacle 1")));
}

TEST_F(CommonRoadTest, RefusesWithTheLine) {
  const std::string car = std::string("<staticObstacle id=\"3\">") + kCar;
  EXPECT_THAT(WhyNot("\n" + car + "</staticObstacle>"),
              HasSubstr("scenario.xml:4: staticObstacle: has no initialState"));
  EXPECT_THAT(WhyNot(car + "<initialState><position><point><x>1</x><y>b</y></point></position>" +
                     Exact("orientation", 0) + "</initialState></staticObstacle>"),
              HasSubstr("y: 'b'"));
  EXPECT_THAT(WhyNot(car + "<initialState><position><lanelet ref=\"1\"/></position>" + Exact("orientation", 0) +
                     "</initialState></staticObstacle>"),
              HasSubstr("lanelet: is no rectangle, circle or polygon"));
  EXPECT_THAT(WhyNot("<environmentObstacle id=\"1\"><shape><polygon>" + Bound({{0, 0}, {1, 1}, {1, 0}, {0, 1}}) +
                     "</polygon></shape></environmentObstacle>"),
              HasSubstr("polygon: the side from"));
  EXPECT_THAT(WhyNot(std::string("<dynamicObstacle id=\"1\">") + kCar + State("initialState", 0, 0, 0, 3) +
                     "<trajectory>" + State("state", 0, 0, 0, 2) + "</trajectory></dynamicObstacle>"),
              HasSubstr("not in the order of time"));
  EXPECT_THAT(WhyNot("<mysteryObstacle id=\"1\"/>"), HasSubstr("no kind of obstacle"));
  EXPECT_THAT(WhyNot("<lanelet>"), HasSubstr("scenario.xml:3: is no XML"));
  std::string deep;
  for (int i = 0; i < 100; ++i) deep += "<a>";
  EXPECT_THAT(WhyNot(deep), HasSubstr("nest deeper"));
  kHead = "<!DOCTYPE a [<!ENTITY b \"b\">]>\n<commonRoad>";
  EXPECT_THAT(WhyNot(""), HasSubstr("document type declaration"));
  kHead = "<commonRoad timeStepSize=\"0.1\" commonRoadVersion=\"2017a\">";
  EXPECT_THAT(WhyNot(""), HasSubstr("commonRoadVersion is 2017a, has to be 2020a or 2018b"));
}

}  // namespace forereach::commonroad_test
