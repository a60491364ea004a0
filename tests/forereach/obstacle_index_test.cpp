// An index of obstacles leaves out nothing that is near, and changes no decision.
#include "forereach/safety/obstacle_index.h"

#include "tests/test.h"

#include "tests/oracle/any_surroundings.h"
#include "tests/oracle/traced_random.h"

namespace forereach::obstacle_index_test {

// All that is reported; NaN would differ from itself.
void ExpectSame(const Decision& a, const Decision& b) {
  EXPECT_FIELDS(a, (outcome, b.outcome), (cause, b.cause), (step, b.step), (coordinate, b.coordinate),
                (obstacle, b.obstacle), (part, b.part), (closest_step, b.closest_step), (margin, b.margin),
                (threshold, b.threshold));
}

Rational SquareOfGap(const Bounds& box, const Hull& hull, int dim) {
  Rational square = 0;
  for (std::size_t k = 0; k < ToSize(dim); ++k) {
    const Rational lower = Rational(hull.center[k]) - Rational(hull.half_width[k]),
                   upper = Rational(hull.center[k]) + Rational(hull.half_width[k]);
    const Rational gap = std::max(Rational(box.lower[k]) - upper, lower - Rational(box.upper[k]));
    if (gap > 0) square += gap * gap;
  }
  return square;
}

HullTree TreeOf(const std::vector<Hull>& hulls, int dim) {
  HullTree tree;
  tree.Build(hulls, dim);
  return tree;
}

TEST(BoxTree, LeavesOutOnlyWhatIsFurtherThanAsked) {
  long left_out = 0;
  for (TracedRandom random(1); random.Again(400);) {
    const int dim = random.Integer(1, 3), count = random.Integer(1, 60);
    const double scale = random.Coin(0.8) ? 20 : std::ldexp(1, random.Integer(-300, 300));
    std::vector<Bounds> boxes(ToSize(count));
    for (Bounds& box : boxes)
      for (std::size_t k = 0; k < ToSize(dim); ++k) {
        const double a = scale * random.Uniform(-1, 1), b = random.Coin(0.2) ? a : a + scale * random.Uniform(-.1, .1);
        box.lower[k] = std::min(a, b);
        box.upper[k] = std::max(a, b);
      }
    std::vector<Hull> hulls(ToSize(random.Integer(1, 12)));
    for (Hull& hull : hulls)
      for (std::size_t k = 0; k < ToSize(dim); ++k) {
        hull.center[k] = scale * random.Uniform(-1.5, 1.5);
        hull.half_width[k] = random.Coin(0.3) ? 0 : scale * random.Uniform(0, 0.3);
      }
    const double reach = random.Coin() ? 0 : scale * random.Uniform(0, 0.2), within = scale * random.Uniform(-0.1, 0.5);
    std::map<std::pair<int, int>, int> visits;
    BoxTree(boxes, dim)
        .ForEachNear(
            TreeOf(hulls, dim), reach, [&] { return within; },
            [&](int t, int i) {
              ++visits[{t, i}];
            });
    const Rational most = Rational(reach) + Rational(std::max(within, 0.0));
    for (int t = 0; t < std::ssize(hulls); ++t)
      for (int i = 0; i < count; ++i) {
        EXPECT_LE((visits[{t, i}]), 1);
        if (visits[{t, i}] > 0) continue;
        ++left_out;
        EXPECT_GT(SquareOfGap(boxes[ToSize(i)], hulls[ToSize(t)], dim), most * most) << "hull " << t << ", box " << i;
      }
  }
  EXPECT_GT(left_out, 1000) << "a tree that visits all shows nothing";
}

TEST(BoxTree, VisitsAllIfTheHullHasNoBounds) {
  const std::vector<Bounds> boxes(20, Bounds{{1, 1, 0}, {2, 2, 0}});
  for (const double end : {kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    std::vector<Hull> hulls(5, Hull{{0, 0, 0}, {0.1, 0.1, 0}});
    for (std::size_t which = 0; which < hulls.size(); ++which) {
      const Hull before = std::exchange(hulls[which], Hull{{0, 0, 0}, {end, 0, 0}});
      int visits = 0;
      BoxTree(boxes, 2).ForEachNear(
          TreeOf(hulls, 2), 0, [] { return 0.0; }, [&](int t, int) { visits += t == static_cast<int>(which) ? 1 : 0; });
      EXPECT_EQ(visits, 20) << which;
      hulls[which] = before;
    }
  }
  const std::vector<Hull> one(1);
  BoxTree().ForEachNear(
      TreeOf(one, 2), 0, [] { return 0.0; }, [](int, int) { ADD_FAILURE(); });
}

TEST(BoxTree, LooksAtFewOfMany) {
  std::vector<Bounds> boxes;
  for (int i = 0; i < 100; ++i)
    for (int j = 0; j < 100; ++j) boxes.push_back({{1.0 * i, 1.0 * j, 0}, {i + 0.5, j + 0.5, 0}});
  int visits = 0;
  const std::vector<Hull> hull{{{50, 50, 0}, {1, 1, 0}}};
  BoxTree(boxes, 2).ForEachNear(
      TreeOf(hull, 2), 0.5, [] { return 1.0; }, [&](int, int) { ++visits; });
  EXPECT_GE(visits, 16);
  EXPECT_LE(visits, 80);
}

TEST(ObstacleIndex, ChangesNoDecisionInRandomWorlds) {
  TracedRandom random(2);
  int certified = 0, touched = 0, drives = 0;
  while (drives < 150) {
    const bool bicycle = random.Coin();
    const auto problem = AnyWorld(random, bicycle);
    Query query = AnyDrive(random, *problem);
    const Certifier certifier(problem);
    Tube tube;
    if (certifier.Certify(query.plan(), query.initial_set, {}, tube).outcome != Outcome::kCertified) continue;
    ++drives;
    const int p = certifier.projection().dim();
    const double spread = random.Coin() ? 8 : 40;
    std::vector<Obstacle> all;
    for (int count = random.Integer(1, 120); count > 0; --count) {
      const auto shape = AnyShape(random, p);
      const Eigen::VectorXd place = random.Vector(p, spread);
      if (random.Coin(0.9) && shape(place).kind() == Obstacle::Kind::kHalfSpace) continue;
      all.push_back(shape(place));
      if (random.Coin(0.15)) all.back() = all.back().Moving(AnyMotion(random, p, query.schedule, tube.length()));
    }
    // Without those that are touched, one after the other, so that there are certificates too.
    for (int attempt = 0; attempt < 200; ++attempt) {
      const ObstacleIndex index(all);
      const Decision plain = certifier.JudgeSafety(query.plan(), all, tube);
      ExpectSame(certifier.JudgeSafety(query.plan(), {all, index}, tube), plain);
      const int later = random.Integer(0, tube.length());
      ExpectSame(certifier.JudgeSafety(query.plan(), {all, index}, tube, later),
                 certifier.JudgeSafety(query.plan(), all, tube, later));
      (plain.outcome == Outcome::kCertified ? certified : touched) += 1;
      if (plain.obstacle < 0 || plain.outcome == Outcome::kCertified) break;
      all.erase(all.begin() + plain.obstacle);
    }
  }
  EXPECT_GT(certified, 100);
  EXPECT_GT(touched, 100);
}

// Cells beside the tube, as many as leave it free, or moving obstacles only: what is left out first is not what counts.
TEST(ObstacleIndex, ChangesNoDecisionAmongManyThatAreNearOrMove) {
  TracedRandom random(3);
  int certified = 0, moving = 0;
  while (certified + moving < 60) {
    const auto problem = AnyWorld(random, random.Coin());
    Query query = AnyDrive(random, *problem);
    const Certifier certifier(problem);
    Tube tube;
    if (certifier.Certify(query.plan(), query.initial_set, {}, tube).outcome != Outcome::kCertified) continue;
    const int p = certifier.projection().dim();
    const bool moves = random.Coin();
    const double spread = random.Coin() ? 6 : 20, room = random.Coin() ? 0 : 0.2;
    std::vector<Obstacle> all;
    for (int i = 0; i < 500; ++i) {
      const Eigen::VectorXd corner = (random.Vector(p, spread) * 4).array().floor() / 4;
      Obstacle cell = Obstacle::AxisBox(corner, corner.array() + 0.25);
      if (moves) cell = cell.Moving(AnyMotion(random, p, query.schedule, tube.length()));
      const Decision alone = certifier.JudgeSafety(query.plan(), {&cell, 1}, tube);
      if (alone.outcome == Outcome::kCertified && !(alone.margin - alone.threshold < room)) all.push_back(cell);
    }
    const ObstacleIndex index(all);
    const Decision plain = certifier.JudgeSafety(query.plan(), all, tube);
    EXPECT_EQ(plain.outcome, Outcome::kCertified);
    ExpectSame(certifier.JudgeSafety(query.plan(), {all, index}, tube), plain);
    (moves ? moving : certified) += 1;
  }
  EXPECT_GT(certified, 10);
  EXPECT_GT(moving, 10);
}

// Many obstacles are as close as the closest: the first of them is named, with an index and without.
TEST(ObstacleIndex, NamesTheFirstOfThoseAsClose) {
  const Certifier certifier(std::make_shared<Problem>(PointMassInHalves()));
  std::vector<Obstacle> cells;
  for (int i = 0; i < 60; ++i)
    for (const double y : {2.0, -3.0}) {
      const Eigen::Vector2d corner(0.5 * i - 8, y);
      cells.push_back(Obstacle::AxisBox(corner, corner + Eigen::Vector2d(0.5, 1)));
    }
  const ObstacleIndex index(cells);
  const std::vector<double> controls(24, 0.0);
  const Plan plan{controls.data(), 2, 12, 2};
  Tube tube;
  for (const double start : {0.0, 0.25, 1.0}) {
    const Zonotope set = Zonotope::FromBox(Vec({start, 0, 1, 0}), Vec({0.125, 0, 0, 0}));
    const Decision plain = certifier.Certify(plan, set, cells, tube);
    EXPECT_EQ(plain.outcome, Outcome::kCertified);
    int as_close = 0;
    for (std::size_t o = 0; o < cells.size(); ++o) {
      if (certifier.SeparateSlice(tube, plain.closest_step, cells[o]).distance != plain.margin) continue;
      EXPECT_LE(plain.obstacle, static_cast<int>(o));
      ++as_close;
    }
    EXPECT_GT(as_close, 0);
    ExpectSame(certifier.Certify(plan, set, {cells, index}, tube), plain);
  }
}

TEST(ObstacleIndex, FindsTheOneThatIsTouchedAmongThousands) {
  const Certifier certifier(std::make_shared<Problem>(PointMassInHalves()));
  std::vector<Obstacle> cells;
  for (int i = 0; i < 64; ++i)
    for (int j = 0; j < 64; ++j) {
      const Eigen::Vector2d corner(i - 30, j + 2);
      cells.push_back(Obstacle::AxisBox(corner, corner + Eigen::Vector2d(0.5, 0.5)));
    }
  const std::vector<double> controls(16, 0.0);
  const Plan plan{controls.data(), 2, 8, 2};
  const Zonotope set = Zonotope::FromBox(Vec({0, 0, 1, 0}), Vec({0, 0, 0, 0}));
  Tube tube;
  EXPECT_EQ(certifier.Certify(plan, set, {cells, ObstacleIndex(cells)}, tube).outcome, Outcome::kCertified);
  cells[3000] = Obstacle::Circle(Vec({2, 0}), 0.1);
  const ObstacleIndex index(cells);
  const Decision found = certifier.Certify(plan, set, {cells, index}, tube);
  EXPECT_FIELDS(found, (outcome, Outcome::kSafety), (obstacle, 3000), (step, 4));
  ExpectSame(found, certifier.Certify(plan, set, cells, tube));
}

// A long body: hulls prove none of the cells beside it apart, and there are more of them than the index keeps at once.
TEST(ObstacleIndex, ChangesNoDecisionWhereMostAreBesideTheBody) {
  Problem problem = PointMassInHalves();
  problem.body.parts = {{{{-5, -0.1, 0}, {5, -0.1, 0}, {5, 0.1, 0}, {-5, 0.1, 0}}, 0}};
  const Certifier certifier(std::make_shared<Problem>(problem));
  std::vector<Obstacle> cells;
  for (int i = 0; i < 60; ++i)
    for (int j = 0; j < 12; ++j) {
      const Eigen::Vector2d corner(0.25 * i - 4, 0.25 * j + (j < 6 ? 0.5 : -4));
      cells.push_back(Obstacle::AxisBox(corner, corner + Eigen::Vector2d(0.125, 0.125)));
    }
  const std::vector<double> controls(16, 0.0);
  const Plan plan{controls.data(), 2, 8, 2};
  const Zonotope set = Zonotope::FromBox(Vec({0, 0, 1, 0}), Vec({0, 0, 0, 0}));
  Tube tube;
  const ObstacleIndex index(cells);
  const Decision clear = certifier.Certify(plan, set, {cells, index}, tube);
  EXPECT_EQ(clear.outcome, Outcome::kCertified);
  ExpectSame(clear, certifier.Certify(plan, set, cells, tube));
  for (const double x : {5.25, 8.75}) {  // met at step 1, or at the last one
    std::vector<Obstacle> blocked = cells;
    for (const int place : {100, 700}) blocked[ToSize(place)] = Obstacle::Circle(Vec({x, 0}), 0.125);
    const ObstacleIndex other(blocked);
    const Decision touched = certifier.Certify(plan, set, {blocked, other}, tube);
    EXPECT_FIELDS(touched, (outcome, Outcome::kSafety), (obstacle, 100), (step, x < 6 ? 1 : 8));
    ExpectSame(touched, certifier.Certify(plan, set, blocked, tube));
  }
}

}  // namespace forereach::obstacle_index_test
