// A grid is the union of its occupied cells: to the last bit, and for each decision.
#include "forereach/safety/occupancy_grid.h"

#include "tests/test.h"

#include "forereach/certify/tube.h"
#include "forereach/certify/way_clear.h"
#include "forereach/safety/clearance.h"
#include "tests/oracle/any_surroundings.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::occupancy_grid_test {

using Map = OccupancyGrid::Map;

Map AnyMap(TracedRandom& random, int largest, double share) {
  Map map{.resolution = random.Coin() ? 0.25 : random.Uniform(0.03, 0.4),
          .origin = {random.Uniform(-9, 9), random.Uniform(-9, 9)},
          .yaw = 0,
          .width = random.Integer(1, largest),
          .height = random.Integer(1, largest),
          .occupied = {},
          .outside_is_free = true};
  for (int i = 0; i < map.width * map.height; ++i) map.occupied.push_back(random.Coin(share));
  return map;
}

Obstacle GridOf(Map map) { return Obstacle::Grid(std::make_shared<const OccupancyGrid>(std::move(map))); }

// Every cell alone.
std::vector<Obstacle> CellsOf(const Map& map) {
  std::vector<Obstacle> cells;
  for (int row = 0; row < map.height; ++row)
    for (int column = 0; column < map.width; ++column) {
      if (!map.occupied[ToSize(row * map.width + column)]) continue;
      Map one = map;
      one.occupied.assign(map.occupied.size(), false);
      one.occupied[ToSize(row * map.width + column)] = true;
      one.outside_is_free = true;
      cells.push_back(OccupancyGrid(one).blocks()[0]);
    }
  return cells;
}

TEST(OccupancyGrid, BlocksAreExactlyTheOccupiedCellsEachOnce) {
  for (TracedRandom random(1); random.Again(300);) {
    const OccupancyGrid grid(AnyMap(random, 20, random.Uniform(0, 1)));
    std::vector<bool> covered(grid.map().occupied.size());
    for (int block = 0; block < std::ssize(grid.blocks()); ++block) {
      const auto [column, row, width, height] = grid.cells(block);
      for (int j = row; j < row + height; ++j)
        for (int i = column; i < column + width; ++i) {
          const auto cell = covered.begin() + j * grid.map().width + i;
          EXPECT_FALSE(*cell);
          *cell = true;
        }
    }
    EXPECT_EQ(covered, grid.map().occupied);
  }
  const OccupancyGrid full(
      Map{.width = 30, .height = 20, .occupied = std::vector<bool>(600, true), .outside_is_free = true});
  EXPECT_EQ(full.blocks().size(), 1u);
  EXPECT_EQ(full.NameOf(0), "cells (0, 0) to (29, 19)");
}

// Rationals: the exact rectangle is inside, and the block is wider by three units in the last place at most.
TEST(OccupancyGrid, BlocksContainTheirCellsAndHardlyMore) {
  for (TracedRandom random(2); random.Again(300);) {
    Map map = AnyMap(random, 12, 0.5);
    if (random.Coin(0.2)) map.origin[0] = std::ldexp(random.Uniform(-1, 1), random.Integer(-60, 29));
    const OccupancyGrid grid(map);
    for (int block = 0; block < std::ssize(grid.blocks()); ++block) {
      const OccupancyGrid::Cells cells = grid.cells(block);
      const Obstacle& box = grid.blocks()[ToSize(block)];
      const std::array first{cells.column, cells.row}, size{cells.width, cells.height};
      for (const std::size_t k : {0u, 1u}) {
        const auto i = static_cast<Eigen::Index>(k);
        const Rational s(map.resolution), o(map.origin[k]), lower = o + s * first[k],
                                                            upper = o + s * (first[k] + size[k]);
        const double hair = 0x1p-51 * (std::abs(map.origin[k]) + map.resolution * (first[k] + size[k]));
        EXPECT_LE(Rational(box.lower()[i]), lower);
        EXPECT_GE(Rational(box.upper()[i]), upper);
        EXPECT_GE(Rational(box.lower()[i] + hair), lower);
        EXPECT_LE(Rational(box.upper()[i] - hair), upper);
      }
    }
  }
}

// 256 bits: corners of occupied cells are on the inner side of every edge of their block, and points beyond the map are
// in one of the half-spaces.
TEST(OccupancyGrid, ATurnedMapContainsItsCellsAndAllBeyond) {
  for (TracedRandom random(3); random.Again(200);) {
    Map map = AnyMap(random, 8, 0.6);
    map.yaw = random.Uniform(-7, 7);
    map.outside_is_free = false;
    const OccupancyGrid grid(map);
    const Real cosine = cos(Real(map.yaw)), sine = sin(Real(map.yaw));
    const auto place = [&](const Real& u, const Real& v) {
      return std::array{Real(map.origin[0]) + cosine * u - sine * v, Real(map.origin[1]) + sine * u + cosine * v};
    };
    const Real s(map.resolution);
    for (int block = 0; block < std::ssize(grid.blocks()); ++block) {
      const OccupancyGrid::Cells cells = grid.cells(block);
      if (cells.width == 0) continue;
      const auto& hull = grid.blocks()[ToSize(block)].points();
      for (const int i : {cells.column, cells.column + cells.width})
        for (const int j : {cells.row, cells.row + cells.height}) {
          const auto [x, y] = place(s * Real(i), s * Real(j));
          for (std::size_t a = 0; a < 4; ++a) {
            const Eigen::VectorXd &from = hull[a], &to = hull[(a + 1) % 4];
            const Real turn = (Real(to[0]) - Real(from[0])) * (y - Real(from[1])) -
                              (Real(to[1]) - Real(from[1])) * (x - Real(from[0]));
            EXPECT_TRUE(turn > Real(-1e-60));
          }
          EXPECT_NEAR(ApproximateDistance(grid.blocks()[ToSize(block)], Vec({x.ToDouble(), y.ToDouble()})), 0, 1e-12);
        }
    }
    const double far = std::ldexp(1, random.Integer(-30, 60)), along = random.Uniform(-1, 1) * far;
    const bool is_column = random.Coin(), is_after = random.Coin();
    const Real beyond = is_after ? s * Real(is_column ? map.width : map.height) + Real(far) : Real(-far);
    const std::array<Real, 2> point = is_column ? place(beyond, Real(along)) : place(Real(along), beyond);
    EXPECT_TRUE(std::ranges::any_of(grid.blocks(), [&](const Obstacle& block) {
      if (block.kind() != Obstacle::Kind::kHalfSpace) return false;
      const auto& normal = block.points()[0];
      return Real(normal[0]) * point[0] + Real(normal[1]) * point[1] > Real(block.offset()) - Real(1e-60);
    })) << far;
  }
}

// As a rectangle for each cell: the same outcome at the same step, and the same clearance but for what a search loses.
TEST(OccupancyGrid, DecidesAsARectangleForEachCell) {
  TracedRandom random(4);
  int certified = 0, touched = 0, between = 0;
  while (certified < 60 || touched < 60) {
    const auto problem = AnyWorld(random, random.Coin());
    const Query query = AnyDrive(random, *problem);
    const Certifier certifier(problem);
    Tube tube;
    if (certifier.projection().dim() != 2) continue;
    if (certifier.Certify(query.plan(), query.initial_set, {}, tube).outcome != Outcome::kCertified) continue;
    Map map = AnyMap(random, 40, random.Coin() ? 0.01 : 0.1);
    if (random.Coin(0.3)) map.yaw = random.Uniform(-3, 3);
    map.outside_is_free = random.Coin(0.7);
    std::vector<Obstacle> cells = CellsOf(map);
    const OccupancyGrid made(map);
    if (!map.outside_is_free)
      for (const Obstacle& block : made.blocks())
        if (block.kind() == Obstacle::Kind::kHalfSpace) cells.push_back(block);
    if (cells.empty()) continue;
    const std::vector<Obstacle> all{Obstacle::Circle(Vec({1e3, 1e3}), 1), GridOf(map),
                                    Obstacle::Circle(Vec({-1e3, 0}), 1)};
    const Decision by_cells = certifier.JudgeSafety(query.plan(), {cells, ObstacleIndex(cells)}, tube);
    const Decision by_grid = certifier.JudgeSafety(query.plan(), {all, ObstacleIndex(all)}, tube);
    const Decision plain = certifier.JudgeSafety(query.plan(), all, tube);
    EXPECT_FIELDS(by_grid, (outcome, by_cells.outcome), (step, by_cells.step), (obstacle, 1),
                  (threshold, by_cells.threshold));
    EXPECT_FIELDS(by_grid, (outcome, plain.outcome), (step, plain.step), (obstacle, plain.obstacle));
    const bool is_certified = by_grid.outcome == Outcome::kCertified;
    // Blocks that share a corner are as close but for the search's tolerance.
    if (is_certified)
      EXPECT_NEAR(by_grid.margin, plain.margin, 2e-5 * (1 + plain.margin));
    else
      EXPECT_FIELDS(by_grid, (block, plain.block), (margin, plain.margin), (part, plain.part));
    if (is_certified) EXPECT_NEAR(by_grid.margin, by_cells.margin, 2e-5 * (1 + by_cells.margin));
    if (is_certified)
      EXPECT_NEAR(certifier.SeparateSlice(tube, by_grid.closest_step, all[1], query.schedule).distance, by_grid.margin,
                  1e-5 * (1 + by_grid.margin));
    else
      EXPECT_THAT(NameOf(all, by_grid.obstacle, by_grid.block), EndsWith(" of obstacle 1"));
    (is_certified ? certified : touched) += 1;
    between += problem->between ? 1 : 0;
  }
  EXPECT_GT(between, 10);
}

// More blocks than a search keeps, beside a slice that is turned: its corners are free of the first ones.
TEST(OccupancyGrid, TheFirstBlockThatIsTouchedIsNamedAmongMany) {
  const Certifier certifier(std::make_shared<Problem>(PointMassInHalves()));
  Zonotope start(Eigen::VectorXd::Zero(4), Eigen::MatrixXd::Zero(4, 2));
  for (TracedRandom random(7); random.Again(20);) {
    Map map{.resolution = 0.125, .origin = {-5, -5}, .width = 80, .height = 80, .outside_is_free = true};
    for (int cell = 0; cell < 6400; ++cell) map.occupied.push_back(random.Coin());
    const std::vector<Obstacle> all{GridOf(map)};
    const double across = random.Uniform(1, 2.5), along = random.Uniform(1, 2.5);
    Eigen::MatrixXd generators = Eigen::MatrixXd::Zero(4, 2);
    generators.topRows(2) << across, along, across, -along;
    start = Zonotope(Eigen::VectorXd::Zero(4), generators);
    Tube tube;
    const Eigen::MatrixXd controls(2, 0);
    const Plan plan{controls.data(), 2, 0, 2, {}};
    const Decision plain = certifier.Certify(plan, start, all, tube),
                   indexed = certifier.Certify(plan, start, {all, ObstacleIndex(all)}, tube);
    EXPECT_FIELDS(indexed, (outcome, Outcome::kSafety), (block, plain.block), (margin, plain.margin));
    EXPECT_GT(plain.block, 0);
  }
}

// The tube of a point mass in binary fractions is exact, and so is whether it touches a cell: zero slack.
TEST(OccupancyGrid, IsClearOnlyOfWhatIsNotTouched) {
  const Certifier certifier(std::make_shared<Problem>(PointMassInHalves()));
  const std::vector<double> controls(16, 0.0);
  const Plan plan{controls.data(), 2, 8, 2};
  Tube tube;
  int touches = 0;
  for (TracedRandom random(5); random.Again(400);) {
    const double x = random.Integer(-8, 8) / 4.0, y = random.Integer(-8, 8) / 4.0, w = random.Integer(0, 4) / 8.0;
    const Zonotope set = Zonotope::FromBox(Vec({x, y, 1, 0}), Vec({w, w, 0, 0}));
    Map map{.resolution = 0.25, .origin = {-4, -4}, .width = 60, .height = 40, .outside_is_free = random.Coin()};
    for (int i = 0; i < map.width * map.height; ++i) map.occupied.push_back(random.Coin(0.01));
    const std::vector<Obstacle> grid{GridOf(map)};
    const Decision decision = certifier.Certify(plan, set, {grid, ObstacleIndex(grid)}, tube);
    int first = -1;
    for (int t = 0; t <= tube.length() && first < 0; ++t) {
      const Rational left = Rational(tube.slice(t).center(0)) - Rational(w), right = left + 2 * Rational(w),
                     low = Rational(tube.slice(t).center(1)) - Rational(w), high = low + 2 * Rational(w), s(0.25);
      bool meets = !map.outside_is_free && (left <= -4 || low <= -4 || right >= -4 + 60 * s || high >= -4 + 40 * s);
      for (int j = 0; j < map.height; ++j)
        for (int i = 0; i < map.width; ++i)
          meets |= map.occupied[ToSize(j * map.width + i)] && left <= -4 + s * (i + 1) && right >= -4 + s * i &&
                   low <= -4 + s * (j + 1) && high >= -4 + s * j;
      if (meets) first = t;
    }
    EXPECT_EQ(decision.outcome, first < 0 ? Outcome::kCertified : Outcome::kSafety);
    EXPECT_EQ(decision.step, first);
    touches += first < 0 ? 0 : 1;
  }
  EXPECT_GT(touches, 50);
  EXPECT_LT(touches, 350);
}

TEST(OccupancyGrid, DistancesAreThoseOfTheNearestCell) {
  for (TracedRandom random(6); random.Again(200);) {
    Map map = AnyMap(random, 15, 0.2);
    if (random.Coin()) map.yaw = random.Uniform(-3, 3);
    map.outside_is_free = random.Coin();
    const Obstacle grid = GridOf(map);
    const Eigen::Vector2d y = random.Vector(2, 12);
    const BodyPart part{{Eigen::Vector3d(y.x(), y.y(), 0), Eigen::Vector3d(y.x() + 1, y.y(), 0)}, 0.125};
    double point = kInfinity, body = kInfinity;
    for (const Obstacle& block : grid.convex()) {
      point = std::min(point, ApproximateDistance(block, y));
      body = std::min(body, ApproximateDistance(block, part));
    }
    EXPECT_EQ(ApproximateDistance(grid, y), point);
    EXPECT_EQ(ApproximateDistance(grid, part), body);
  }
}

TEST(OccupancyGrid, RefusesMapsThatAreNone) {
  const auto why_not = [](const Map& map) {
    return Thrown<std::invalid_argument>([&] { static_cast<void>(OccupancyGrid(map)); });
  };
  const Map fine{.resolution = 0.5, .width = 2, .height = 1, .occupied = {true, false}};
  const auto with = [&](auto member, auto value) {
    Map map = fine;
    map.*member = value;
    return why_not(map);
  };
  EXPECT_EQ(why_not(fine), "");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double resolution : {0.0, -1.0, nan, kInfinity, 1e7})
    EXPECT_THAT(with(&Map::resolution, resolution), HasSubstr("is outside (0, 1e+06]"));
  for (const double x : {nan, kInfinity, -2e9})
    EXPECT_THAT(with(&Map::origin, std::array{0.0, x}), HasSubstr("grid: origin"));
  EXPECT_THAT(with(&Map::yaw, nan), HasSubstr("grid: yaw nan"));
  Map tiny = fine;
  tiny.resolution = 5e-324;
  tiny.yaw = 1;
  EXPECT_THAT(why_not(tiny), HasSubstr("is too small for a turned map"));
  EXPECT_THAT(with(&Map::width, 1 << 30), HasSubstr("1073741824 by 1 cells, must be 1 to 16777216 in all"));
  EXPECT_THAT(with(&Map::height, 0), HasSubstr("2 by 0 cells"));
  EXPECT_THAT(with(&Map::width, 3), HasSubstr("2 values of 3 cells"));
  Map board{.width = 1000, .height = 1000};
  for (int i = 0; i < 1'000'000; ++i) board.occupied.push_back((i + i / 1000) % 2 == 0);
  EXPECT_THAT(why_not(board), HasSubstr("make more than 131072 rectangles, 263 rows from below"));
}

TEST(OccupancyGrid, BlocksHaveTheNumbersThatFindThem) {
  for (TracedRandom random(8); random.Again(100);) {
    std::vector<Obstacle> all;
    for (int o = random.Integer(1, 12); o > 0; --o)
      all.push_back(random.Coin() ? GridOf(AnyMap(random, 4, random.Coin() ? 0 : 0.5))
                                  : Obstacle::Circle(Vec({0, 0}), 1));
    const ConvexNumbers numbers(all);
    for (int number = 0; number < numbers.size(); ++number)
      EXPECT_EQ(numbers.NumberOf(numbers.PlaceOf(number)), number);
  }
}

// Also where it could not stand: far from its origin.
TEST(OccupancyGrid, WayClearOfAMapIsFoundWithinItsSize) {
  const Certifier certifier(std::make_shared<Problem>(PointMassInHalves()));
  const Zonotope start = Zonotope::FromBox(Vec({0, 0, 2, 0}), Eigen::VectorXd::Constant(4, 0.01));
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(2, 4);
  const Plan plan{controls.data(), 2, 4, 2, {}};
  Map map{.resolution = 1e6, .origin = {-5e8, -5e5}, .width = 1000, .height = 1};
  map.occupied.assign(1000, true);
  for (const bool outside_is_free : {true, false}) {
    map.outside_is_free = outside_is_free;
    const std::vector<Obstacle> all{GridOf(map)};
    Tube tube;
    ASSERT_EQ(certifier.Certify(plan, start, all, tube).outcome, Outcome::kSafety);
    const auto ways = FindWayClear(certifier, plan, all, tube);
    ASSERT_EQ(ways.has_value(), outside_is_free);
    if (ways) EXPECT_NEAR(ways->at(0).shift.norm(), 5e5, 1e4);
  }
}

TEST(OccupancyGrid, DoesNotMoveAndThereAreFew) {
  const Obstacle grid = GridOf({.width = 1, .height = 1, .occupied = {true}});
  EXPECT_THROW(static_cast<void>(grid.Moving({})), std::invalid_argument);
  const Certifier certifier(std::make_shared<Problem>(PointMassInHalves()));
  const std::vector<double> controls(16, 0.0);
  const Zonotope set = Zonotope::FromBox(Vec({9, 9, 0, 0}), Vec({0, 0, 0, 0}));
  Map corners{.width = 20, .height = 20, .occupied = std::vector<bool>(400), .outside_is_free = true};
  corners.occupied.front() = corners.occupied.back() = true;
  std::vector<Obstacle> grids(ConvexNumbers::kMostGrids + 1, GridOf(corners));
  const Plan plan{controls.data(), 2, 8, 2};
  EXPECT_THAT(Thrown<std::invalid_argument>([&] { certifier.Require(plan, set, grids); }),
              HasSubstr("9 grids, must be at most 8"));
  Tube tube;
  const Decision decision = certifier.Certify(plan, set, grids, tube);
  EXPECT_FIELDS(decision, (outcome, Outcome::kSafety), (obstacle, 8));
  EXPECT_EQ(certifier.Certify(plan, set, {grids, ObstacleIndex(grids)}, tube).obstacle, 8);
  grids.pop_back();
  EXPECT_EQ(certifier.Certify(plan, set, grids, tube).outcome, Outcome::kCertified);
}

}  // namespace forereach::occupancy_grid_test
