// An index of obstacles leaves out nothing that is near, and changes no decision.
#include "forereach/safety/obstacle_index.h"

#include "tests/test.h"

#include "forereach/certify/tube.h"
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
    // The sets themselves are what is within half of their hulls' widths.
    const bool has_sets = random.Coin();
    std::vector<Hull> sets = hulls;
    for (Hull& set : sets)
      for (std::size_t k = 0; has_sets && k < ToSize(dim); ++k) set.half_width[k] /= 2;
    std::map<std::pair<int, int>, int> visits;
    const BoxTree tree(boxes, dim);
    for (int t = 0; t < std::ssize(hulls); ++t) {
      const auto gap = [&](const BoxTree::Four& some) __attribute__((always_inline)) {
        Lanes gaps = AllLanes(-1);
        for (std::size_t lane = 0; has_sets && lane < kLaneCount; ++lane) {
          double square = 0;
          for (std::size_t k = 0; k < ToSize(dim); ++k) {
            const auto& [center, half_width] = sets[ToSize(t)];
            const double apart = std::abs(some.center[k][lane] - center[k]) - some.half_width[k][lane] - half_width[k];
            if (apart > 0) square += apart * apart;
          }
          gaps[lane] = std::sqrt(square);
        }
        return gaps;
      };
      double nearest = kInfinity;
      tree.ForEachNear(
          hulls[ToSize(t)], reach, [&] { return within; },
          [&](int i, double least) {
            ++visits[{t, i}];
            nearest = std::min(nearest, least);
            const Rational square = SquareOfGap(boxes[ToSize(i)], sets[ToSize(t)], dim);
            EXPECT_LE(Rational(least) * Rational(least), square + Rational(std::ldexp(scale, -40)) * Rational(scale))
                << "hull " << t << ", box " << i;
          },
          gap);
      const BoxTree::Found found = tree.FindNear(hulls[ToSize(t)], gap);
      EXPECT_TRUE(0 <= found.box && found.box < count) << found.box;
      EXPECT_GE(std::sqrt(found.square) * (1 + 1e-9), nearest == kInfinity ? 0 : std::min(nearest, within));
    }
    const Rational most = Rational(reach) + Rational(std::max(within, 0.0));
    for (int t = 0; t < std::ssize(hulls); ++t)
      for (int i = 0; i < count; ++i) {
        EXPECT_LE((visits[{t, i}]), 1);
        if (visits[{t, i}] > 0) continue;
        ++left_out;
        EXPECT_GT(SquareOfGap(boxes[ToSize(i)], sets[ToSize(t)], dim), most * most) << "hull " << t << ", box " << i;
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
          hulls[which], 0, [] { return 0.0; }, [&](int, double) { ++visits; });
      EXPECT_EQ(visits, 20) << which;
      hulls[which] = before;
    }
  }
  BoxTree().ForEachNear(
      Hull{}, 0, [] { return 0.0; }, [](int, double) { ADD_FAILURE(); });
}

TEST(BoxTree, LooksAtFewOfMany) {
  std::vector<Bounds> boxes;
  for (int i = 0; i < 100; ++i)
    for (int j = 0; j < 100; ++j) boxes.push_back({{1.0 * i, 1.0 * j, 0}, {i + 0.5, j + 0.5, 0}});
  int visits = 0;
  BoxTree(boxes, 2).ForEachNear(
      Hull{{50, 50, 0}, {1, 1, 0}}, 0.5, [] { return 1.0; }, [&](int, double) { ++visits; });
  EXPECT_GE(visits, 16);
  EXPECT_LE(visits, 80);
}

// The square of the distance between the boxes around a unit's hulls and around an obstacle that moves, as seen from it
// at both samples, and what has to be kept: exact but for the length of the velocity, which is rounded up.
struct Apart {
  Rational square, kept;
};
Apart ApartAt(std::span<const Hull> samples, int t, int span, const Obstacle& obstacle, const Schedule& schedule) {
  const ObstacleMotion& motion = *obstacle.motion();
  const auto seconds = [](std::int64_t us) -> Rational { return Rational(us) / 1'000'000; };
  Apart apart{0, Rational(obstacle.radius()) + Rational(motion.uncertainty)};
  std::int64_t longest = 0;
  for (int k = 0; k < obstacle.dim(); ++k) {
    std::optional<Rational> lower, upper;
    for (const int sample : {t, t + span}) {
      const std::int64_t at = schedule.start_us + sample * schedule.step_us;
      longest = std::max(
          {longest, motion.stamp_us - at + schedule.clock_error_us, at + schedule.clock_error_us - motion.stamp_us});
      const Hull& hull = samples[ToSize(sample)];
      const Rational middle =
          Rational(hull.center[ToSize(k)]) - Rational(motion.velocity[k]) * seconds(at - motion.stamp_us);
      const Rational low = middle - Rational(hull.half_width[ToSize(k)]),
                     high = middle + Rational(hull.half_width[ToSize(k)]);
      lower = lower ? std::min(*lower, low) : low;
      upper = upper ? std::max(*upper, high) : high;
    }
    const Rational gap =
        std::max(Rational(Rational(obstacle.lower()[k]) - *upper), Rational(*lower - Rational(obstacle.upper()[k])));
    if (gap > 0) apart.square += gap * gap;
  }
  const Rational tau = seconds(longest);
  apart.kept += Rational(motion.growth) * tau + Rational(motion.growth_rate) * tau * tau / 2 +
                Rational(motion.velocity.norm() * (1 + 1e-14)) * seconds(schedule.clock_error_us);
  return apart;
}

TEST(MotionTree, LeavesOutOnlyWhatIsNowhereOrFurtherThanAsked) {
  long nowhere = 0, far = 0;
  for (TracedRandom random(4); random.Again(400);) {
    const int p = random.Integer(1, 3), units = random.Integer(1, 12), span = random.Integer(0, 1);
    const Schedule schedule = AnySchedule(random);
    const double scale = random.Coin(0.9) ? 20 : std::ldexp(1, random.Integer(-40, 200));
    std::vector<Hull> samples(ToSize(units + span)), hulls;
    for (Hull& hull : samples)
      for (std::size_t k = 0; k < ToSize(p); ++k) {
        hull.center[k] = scale * random.Uniform(-1.5, 1.5);
        hull.half_width[k] = random.Coin(0.3) ? 0 : scale * random.Uniform(0, 0.1);
      }
    for (std::size_t t = 0; t < ToSize(units); ++t) hulls.push_back(Join(samples[t], samples[t + ToSize(span)], p));
    std::vector<Obstacle> obstacles;
    for (int count = random.Integer(1, 60); count > 0; --count) {
      const Obstacle shape = AnyShape(random, p)(random.Vector(p, scale));
      if (shape.kind() == Obstacle::Kind::kHalfSpace) continue;
      ObstacleMotion motion = AnyMotion(random, p, schedule, units);
      if (random.Coin(0.1)) motion.velocity *= scale;
      if (random.Coin(0.02)) motion.stamp_us = random.Coin() ? Schedule::kLatest : -Schedule::kLatest;
      if (random.Coin(0.02)) motion.from_us = -ObstacleMotion::kAlways + random.Below(9);
      if (random.Coin(0.02)) motion.until_us = ObstacleMotion::kAlways - random.Below(9);
      obstacles.push_back(shape.Moving(motion));
    }
    std::vector<const Obstacle*> moving;
    for (const Obstacle& obstacle : obstacles) moving.push_back(&obstacle);
    const double reach = random.Coin() ? 0 : scale * random.Uniform(0, 0.2), within = scale * random.Uniform(-0.1, 0.5);
    const int first = random.Integer(0, 3);
    Schedule shifted = schedule;
    shifted.start_us -= first * schedule.step_us;
    std::map<std::pair<int, int>, int> visits;
    MotionTree(moving).ForEachNear(
        TreeOf(hulls, p), {shifted, first, span}, reach, [&] { return within; },
        [&](int t, int i) {
          ++visits[{t, i}];
        });
    const Rational most = Rational(reach) + Rational(std::max(within, 0.0));
    for (int t = 0; t < units; ++t)
      for (int i = 0; i < std::ssize(obstacles); ++i) {
        EXPECT_LE((visits[{t, i}]), 1);
        if (visits[{t, i}] > 0) continue;
        if (!Meet(*obstacles[ToSize(i)].motion(), schedule, t, t + span).is_there) {
          ++nowhere;
          continue;
        }
        ++far;
        const auto [square, kept] = ApartAt(samples, t, span, obstacles[ToSize(i)], schedule);
        EXPECT_GT(square, (kept + most) * (kept + most)) << "hull " << t << ", obstacle " << i;
      }
  }
  EXPECT_GT(nowhere, 1000);
  EXPECT_GT(far, 1000) << "a tree that visits all shows nothing";
}

// A point that the growth of one obstacle just reaches, in a node whose time is the stamp of another one.
TEST(MotionTree, FindsWhatItsGrowthJustReaches) {
  for (TracedRandom random(6); random.Again(300);) {
    const auto some = [&](double most) { return random.Coin(0.3) ? 0 : random.Uniform(0, most); };
    ObstacleMotion motion, other;
    motion.stamp_us = random.Integer(-5, 5) * 1'000'000;
    other.stamp_us = random.Integer(-5, 5) * 1'000'000;
    other.velocity[0] = motion.velocity[0] = random.Uniform(-5, 5);
    motion.uncertainty = some(1);
    motion.growth = some(3);
    motion.growth_rate = some(3);
    const Schedule schedule{random.Integer(-10, 10) * 1'000'000, 100'000, 0};
    const Encounter meeting = Meet(motion, schedule, 0, 0);
    for (const int side : {-1, 1}) {
      const Obstacle far = Obstacle::AxisBox(Vec({-1e4 * side}), Vec({-1e4 * side})).Moving(other),
                     near = Obstacle::AxisBox(Vec({-1}), Vec({1})).Moving(motion);
      const std::vector<const Obstacle*> moving{&far, &near};
      std::vector<Hull> hulls(1);
      hulls[0].center[0] = meeting.shift[0][0].Middle() + side * (1 + meeting.growth * (1 - 1e-9));
      bool is_found = false;
      MotionTree(moving).ForEachNear(
          TreeOf(hulls, 1), {schedule, 0, 0}, 0, [] { return 0.0; }, [&](int, int i) { is_found |= i == 1; });
      EXPECT_TRUE(is_found) << side;
    }
  }
}

// A window is closed, and wider by the clock's error: one microsecond beyond it the obstacle is nowhere.
TEST(MotionTree, FindsWhatIsThereAtTheEndOfAWindowToTheMicrosecond) {
  ObstacleMotion motion;
  motion.stamp_us = motion.from_us = 1'000'000;
  motion.until_us = 2'000'000;
  const Obstacle obstacle = Obstacle::Circle(Vec({0, 0}), 1).Moving(motion);
  const std::vector<const Obstacle*> moving{&obstacle};
  const MotionTree tree(moving);
  const std::vector<Hull> hulls(2);  // sample 0 to 1, and 1 to 2
  const auto visited = [&](std::int64_t start_us, std::int64_t error_us) {
    std::vector<int> found;
    const Schedule schedule{start_us, 100'000, error_us};
    tree.ForEachNear(
        TreeOf(hulls, 2), {schedule, 0, 1}, 0, [] { return 0.0; }, [&](int t, int) { found.push_back(t); });
    std::ranges::sort(found);
    return found;
  };
  using testing::ElementsAre;
  EXPECT_THAT(visited(2'000'000, 0), ElementsAre(0));
  EXPECT_THAT(visited(2'000'001, 0), ElementsAre());
  EXPECT_THAT(visited(2'000'050, 50), ElementsAre(0));
  EXPECT_THAT(visited(2'000'051, 50), ElementsAre());
  EXPECT_THAT(visited(800'000, 0), ElementsAre(1));
  EXPECT_THAT(visited(799'999, 0), ElementsAre());
  EXPECT_THAT(visited(1'500'000, 0), ElementsAre(0, 1));
}

TEST(MotionTree, VisitsAllIfNumbersAreTooLarge) {
  ObstacleMotion motion;
  motion.velocity = {1e308, -1e308, 0};
  motion.growth = 1e308;
  std::vector<Obstacle> obstacles;
  for (int i = 0; i < 20; ++i) {
    motion.stamp_us = i % 3 * 10'000'000;
    obstacles.push_back(Obstacle::Circle(Vec({100.0 * i, 5}), 1).Moving(i % 2 ? motion : ObstacleMotion{}));
  }
  std::vector<const Obstacle*> moving;
  for (const Obstacle& obstacle : obstacles) moving.push_back(&obstacle);
  const std::vector<Hull> hulls(3);
  int visits = 0;
  MotionTree(moving).ForEachNear(
      TreeOf(hulls, 2), {{5'000'000, 100'000, 0}, 0, 0}, 0, [] { return 0.0; }, [&](int, int) { ++visits; });
  EXPECT_EQ(visits, 60);
}

// A crossing of many in short windows, as predictions are: at most a few are near the plan when it is there.
TEST(MotionTree, LooksAtFewOfMany) {
  TracedRandom random(5);
  std::vector<Obstacle> obstacles;
  for (int i = 0; i < 4000; ++i) {
    ObstacleMotion motion;
    motion.stamp_us = motion.from_us = random.Integer(0, 39) * 100'000;
    motion.until_us = motion.from_us + 100'000;
    motion.velocity.head(2) = random.Vector(2, 15);
    obstacles.push_back(Obstacle::Circle(random.Vector(2, 100), 0.5).Moving(motion));
  }
  std::vector<const Obstacle*> moving;
  for (const Obstacle& obstacle : obstacles) moving.push_back(&obstacle);
  std::vector<Hull> hulls;
  for (int t = 0; t < 20; ++t) hulls.push_back({{t - 10.0, 0, 0}, {0.5, 0.5, 0}});
  int visits = 0;
  MotionTree(moving).ForEachNear(
      TreeOf(hulls, 2), {{0, 100'000, 0}, 0, 1}, 1, [] { return 0.0; }, [&](int, int) { ++visits; });
  EXPECT_LE(visits, 100);  // of 80,000 pairs
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

// The part of the robot's frame at the same places by expressions of the state.
BodyPart AtExpressions(const BodyPart& part, const NominalModel& model) {
  const auto names = model.state_names();
  BodyPart same{{}, part.radius};
  for (const Eigen::Vector3d& q : part.points) {
    const std::string a = std::to_string(q[0]), b = std::to_string(q[1]), turn = "(" + names[2] + ")";
    same.places.push_back({{names[0] + " + " + a + "*cos" + turn + " - " + b + "*sin" + turn},
                           {names[1] + " + " + a + "*sin" + turn + " + " + b + "*cos" + turn}});
  }
  return same;
}

// A long body that may turn: its sides leave out what the box around it meets.
TEST(ObstacleIndex, ChangesNoDecisionBesideALongBodyThatTurns) {
  TracedRandom random(7);
  int certified = 0, touched = 0;
  for (int drives = 0; drives < 60;) {
    Problem problem = *AnyWorld(random, true);
    const double length = random.Uniform(0.5, 4), width = random.Uniform(0, 1), ahead = random.Uniform(-1, 3);
    problem.projection = Eigen::MatrixXd::Identity(2, problem.model->num_states());
    problem.between.reset();
    if (random.Coin()) problem.between = AnyBetween(random, 2, 0.1);
    problem.body = {2, {{{{ahead + length, width, 0}, {ahead - length, width, 0}, {ahead - length, -width, 0}}, 0}}};
    if (random.Coin()) problem.body.parts[0].points.push_back({ahead + length, -width, 0});
    if (random.Coin(0.3)) std::ranges::reverse(problem.body.parts[0].points);
    if (random.Coin(0.3)) problem.body.parts.push_back({{{-length, 0, 0}, {length, 0, 0}}, 0.3});
    if (const double share = random.Coin() ? random.Uniform(0, 2) : 0; share > 0)
      for (BodyPart& part : problem.body.parts)
        if (random.Coin(std::min(share, 1.0))) part = AtExpressions(part, *problem.model);
    const Certifier certifier(std::make_shared<Problem>(problem));
    Query query = AnyDrive(random, problem);
    Tube tube;
    if (certifier.Certify(query.plan(), query.initial_set, {}, tube).outcome != Outcome::kCertified) continue;
    ++drives;
    std::vector<Obstacle> all;
    for (int i = 0; i < 400; ++i) {
      const Eigen::VectorXd corner = (random.Vector(2, 8) * 4).array().floor() / 4;
      const Obstacle some = random.Coin(0.8) ? Obstacle::AxisBox(corner, corner.array() + 0.25)
                                             : Obstacle::Circle(corner, random.Uniform(0, 0.3));
      const Decision alone = certifier.JudgeSafety(query.plan(), {&some, 1}, tube);
      if (alone.outcome == Outcome::kCertified || random.Coin(0.01)) all.push_back(some);
    }
    const ObstacleIndex index(all);
    const Decision plain = certifier.JudgeSafety(query.plan(), all, tube);
    ExpectSame(certifier.JudgeSafety(query.plan(), {all, index}, tube), plain);
    (plain.outcome == Outcome::kCertified ? certified : touched) += 1;
  }
  EXPECT_GT(certified, 10);
  EXPECT_GT(touched, 3);
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
