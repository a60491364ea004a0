// Bodies, motion between samples, and obstacles that move: each at its boundary, just inside and just outside.
#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "tests/worlds.h"

namespace forereach::sweep_test {

using Eigen::Vector3d;

constexpr double kHair = 1e-9;  // above the rounding of a few steps, metres

Problem PointMassProblem() { return PointMassInHalves(8); }
Problem BicycleProblem() {
  return WorldOf(MakeKinematicBicycle(0.5, 2.5), Within({40, 40, 3.2, 25, 3, 1}), Within({20, 2}));
}

Between Curving(double x, double y) { return {.acceleration = Vec({x, y}), .period = 0.5}; }

Decision Judge(const Problem& problem, const Eigen::VectorXd& start, int steps, const std::vector<Obstacle>& obstacles,
               const Schedule& schedule = {}, const Eigen::VectorXd& half_width = {}) {
  const Certifier certifier(std::make_shared<Problem>(problem));
  Tube tube;
  const std::vector<double> controls(2 * static_cast<std::size_t>(steps), 0.0);
  const Plan plan{controls.data(), 2, steps, 2, schedule};
  const auto set = Zonotope::FromBox(start, half_width.size() > 0 ? half_width : Eigen::VectorXd(0 * start));
  certifier.Require(plan, set, obstacles);
  return certifier.Certify(plan, set, obstacles, tube);
}

bool IsCertified(const Decision& decision) { return decision.outcome == Outcome::kCertified; }

Body Parts(std::vector<BodyPart> parts, int heading = -1) { return {heading, std::move(parts)}; }

// 2 m a step along x; the bulge in y is 2 * 0.5^2 / 8.
TEST(Between, APostBetweenTwoSamplesCounts) {
  Problem problem = PointMassProblem();
  const auto post = [](double x, double gap) {
    return std::vector{Obstacle::Circle(Vec({x, 0.05 + 0.0625 + gap}), 0.05)};
  };
  const Eigen::VectorXd start = Vec({0, 0, 4, 0});
  EXPECT_TRUE(IsCertified(Judge(problem, start, 3, post(1, -0.1))));  // at its samples only
  problem.between = Curving(0, 2);
  for (const double x : {0.0, 1.0, 3.9, 6.0}) {
    EXPECT_TRUE(IsCertified(Judge(problem, start, 3, post(x, kHair)))) << x;
    const Decision touched = Judge(problem, start, 3, post(x, -kHair));
    EXPECT_EQ(touched.outcome, Outcome::kSafety) << x;
    EXPECT_EQ(touched.step, x < 2 ? 0 : x < 4 ? 1 : 2) << x;
    EXPECT_EQ(touched.part, 0);
  }
  EXPECT_TRUE(IsCertified(Judge(problem, start, 3, {Obstacle::Circle(Vec({6.05 + kHair, 0}), 0.05)})));
}

TEST(Between, ASampleBelongsToBothOfItsSteps) {
  Problem problem = PointMassProblem();
  problem.between = Curving(0, 0);
  const Decision d = Judge(problem, Vec({0, 0, 4, 0}), 3, {Obstacle::Circle(Vec({4, 1}), 0.5)});
  EXPECT_TRUE(IsCertified(d));
  EXPECT_THAT(d.closest_step, AnyOf(1, 2));
  EXPECT_NEAR(d.margin, 1, 1e-12);
}

// The chord from (0, 0) to (2, 2): the sweep is not the box around it.
TEST(Between, TheSweepIsTheHullOfBothSlices) {
  Problem problem = PointMassProblem();
  problem.between = Curving(0, 0);
  const auto corner = [](double radius) { return std::vector{Obstacle::Circle(Vec({1.5, 0.5}), radius)}; };
  const double distance = std::sqrt(0.5);
  EXPECT_TRUE(IsCertified(Judge(problem, Vec({0, 0, 4, 4}), 1, corner(distance - kHair))));
  EXPECT_FALSE(IsCertified(Judge(problem, Vec({0, 0, 4, 4}), 1, corner(distance + kHair))));
}

TEST(Between, AHalfPlaneIsMetBetweenSamples) {
  Problem problem = PointMassProblem();
  problem.between = Curving(0, 2);
  const auto wall = [](double offset) { return std::vector{Obstacle::HalfSpace(Vec({0, 1}), offset)}; };
  EXPECT_TRUE(IsCertified(Judge(problem, Vec({0, 0, 4, 0}), 1, wall(0.0625 + kHair))));
  EXPECT_FALSE(IsCertified(Judge(problem, Vec({0, 0, 4, 0}), 1, wall(0.0625 - kHair))));
}

TEST(Body, ADiscAndAHullThatDoNotTurnAreJudgedWithinAHair) {
  Problem problem = PointMassProblem();
  const Eigen::VectorXd start = Vec({0, 0, 0, 0});
  const auto disc_at = [](double x, double y) { return std::vector{Obstacle::Circle(Vec({x, y}), 1)}; };
  problem.body = Parts({{{Vector3d(2, 0, 0)}, 0.5}});
  EXPECT_TRUE(IsCertified(Judge(problem, start, 1, disc_at(3.5 + kHair, 0))));
  EXPECT_FALSE(IsCertified(Judge(problem, start, 1, disc_at(3.5 - kHair, 0))));
  problem.body = Parts({{{Vector3d(-1, 2, 0), Vector3d(1, 2, 0)}, 0}, {{Vector3d(0, 0, 0), Vector3d(2, 2, 0)}, 0.25}});
  EXPECT_TRUE(IsCertified(Judge(problem, start, 1, disc_at(0, 3 + kHair))));
  const Decision edge = Judge(problem, start, 1, disc_at(0, 3 - kHair));  // between the points of part 0
  EXPECT_FIELDS(edge, (outcome, Outcome::kSafety), (part, 0));
  const double distance = std::sqrt(0.5) + 0;  // of (2, 1) from the segment of part 1
  EXPECT_NEAR(Judge(problem, start, 1, {Obstacle::Circle(Vec({2, 1}), 0)}).margin, distance, 1e-9);
  EXPECT_EQ(Judge(problem, start, 1, {Obstacle::Circle(Vec({2, 1}), distance - 0.25 - kHair)}).part, 1);
  EXPECT_FALSE(IsCertified(Judge(problem, start, 1, {Obstacle::Circle(Vec({2, 1}), distance - 0.25 + kHair)})));
}

// A bicycle that stands: its corner is at R(theta) q.
TEST(Body, TurnsWithTheHeading) {
  Problem problem = BicycleProblem();
  problem.body = Parts({{{Vector3d(3, 1, 0), Vector3d(-1, 1, 0), Vector3d(3, -1, 0), Vector3d(-1, -1, 0)}, 0}}, 2);
  for (const double theta : {0.5, -2.0, 3.0}) {
    const double c = std::cos(theta), s = std::sin(theta);
    const double x = 3 * c - s, y = 3 * s + c, away = std::hypot(3.0, 1.0);
    const auto post = [&](double gap) {  // in the direction of the corner from the origin
      const double far = (away + 0.5 + gap) / away;
      return std::vector{Obstacle::Circle(Vec({x * far, y * far}), 0.5)};
    };
    const Eigen::VectorXd start = Vec({0, 0, theta, 0, 0, 0});
    EXPECT_TRUE(IsCertified(Judge(problem, start, 1, post(kHair)))) << theta;
    EXPECT_FALSE(IsCertified(Judge(problem, start, 1, post(-kHair)))) << theta;
  }
}

// Over a range of headings a point 3 m ahead stays on an arc; the enclosure is the tangent and the sagitta.
TEST(Body, APlaceIsCorrelatedWithTheSlice) {
  Problem problem = BicycleProblem();
  problem.body = Parts({{{Vector3d(3, 0, 0)}, 0}}, 2);
  const Eigen::VectorXd start = Vec({0, 0, 0, 0, 0, 0}), spread = Vec({0, 0, 0.1, 0, 0, 0});
  const auto judge = [&](double nx, double ny, double offset) {
    return IsCertified(Judge(problem, start, 1, {Obstacle::HalfSpace(Vec({nx, ny}), offset)}, {}, spread));
  };
  EXPECT_TRUE(judge(1, 0, 3 + kHair));
  EXPECT_FALSE(judge(1, 0, 3 - kHair));
  EXPECT_TRUE(judge(0, 1, 3 * (0.1 + (0.1 + 0.005) * 0.005) + kHair));
  EXPECT_FALSE(judge(0, 1, 3 * std::sin(0.1) - kHair));
  EXPECT_TRUE(judge(-1, 0, -3 * std::cos(0.1) + 0.001));
  EXPECT_FALSE(judge(-1, 0, -3 * std::cos(0.1) - kHair));
}

// A point 2 m ahead that may turn by 1 rad/s and 3 rad/s^2 leaves its chord by 2 (1 + 3) 0.5^2 / 8.
TEST(Body, ATurningPointIsWidenedByItsBulge) {
  Problem problem = BicycleProblem();
  problem.body = Parts({{{Vector3d(2, 0, 0)}, 0}}, 2);
  problem.between = Curving(0, 0);
  problem.between->turn_rate = 1;
  problem.between->turn_acceleration = 3;
  const auto post = [](double gap) { return std::vector{Obstacle::Circle(Vec({2.5 + 0.25 + gap, 0}), 0.5)}; };
  EXPECT_TRUE(IsCertified(Judge(problem, Vec({0, 0, 0, 0, 0, 0}), 1, post(kHair))));
  EXPECT_FALSE(IsCertified(Judge(problem, Vec({0, 0, 0, 0, 0, 0}), 1, post(-kHair))));
}

TEST(Body, IsRefusedIfItIsMalformed) {
  const auto refusal = [](const std::function<void(Problem&)>& change) -> std::string {
    Problem problem = BicycleProblem();
    change(problem);
    try {
      const Certifier certifier(std::make_shared<Problem>(problem));
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal([](Problem&) {}), "accepted");
  EXPECT_THAT(refusal([](Problem& p) { p.body.heading = 6; }), StartsWith("body: heading 6"));
  EXPECT_THAT(refusal([](Problem& p) { p.projection.conservativeResize(1, 6), p.body.heading = 2; }),
              StartsWith("body: heading 2"));
  EXPECT_THAT(refusal([](Problem& p) { p.body.parts.clear(); }), StartsWith("body: 0 parts"));
  EXPECT_THAT(refusal([](Problem& p) { p.body.parts[0].points.clear(); }), StartsWith("body: part 0: no points"));
  EXPECT_THAT(refusal([](Problem& p) { p.body.parts[0].points.resize(17, Vector3d::Zero()); }),
              StartsWith("body: 17 points"));
  EXPECT_THAT(refusal([](Problem& p) { p.body.parts.resize(17); }), StartsWith("body: 17 parts"));
  EXPECT_THAT(refusal([](Problem& p) { p.body.parts[0].points[0][2] = 1; }), StartsWith("body: part 0: a point has"));
  EXPECT_THAT(refusal([&](Problem& p) { p.body.parts[0].points[0][0] = nan; }), StartsWith("body: part 0: a point"));
  for (const double size : {-1.0, nan, kInfinity}) {
    EXPECT_THAT(refusal([&](Problem& p) { p.body.parts[0].radius = size; }), StartsWith("body: part 0: radius"));
    EXPECT_THAT(refusal([&](Problem& p) { p.between = Curving(0, size); }), StartsWith("between: acceleration"));
    EXPECT_THAT(refusal([&](Problem& p) { p.between = Curving(0, 0), p.between->turn_rate = size; }),
                StartsWith("between: turn_rate"));
    EXPECT_THAT(refusal([&](Problem& p) { p.between = Curving(0, 0), p.between->turn_acceleration = size; }),
                StartsWith("between: turn_acceleration"));
    EXPECT_THAT(refusal([&](Problem& p) { p.between = Curving(0, 0), p.between->period = size; }),
                StartsWith("between: period"));
  }
  EXPECT_THAT(refusal([](Problem& p) { p.between = Between{Vec({1}), 0, 0, 1}; }), StartsWith("between: 1 acc"));
}

Obstacle Approaching(double radius, const ObstacleMotion& motion) {
  return Obstacle::Circle(Vec({10, 0}), radius).Moving(motion);
}
ObstacleMotion AtFour() {
  ObstacleMotion motion;
  motion.velocity = Vector3d(-4, 0, 0);
  return motion;
}

// The robot stands at the origin for 2 s; the obstacle comes from 10 m to 2 m.
TEST(Moving, IsWhereItIsAtTheTimeOfTheStep) {
  const Eigen::VectorXd rest = Vec({0, 0, 0, 0});
  const Schedule schedule{7'000'000, 500'000, 0};
  ObstacleMotion motion = AtFour();
  motion.stamp_us = 7'000'000;
  for (const bool sweeps : {false, true}) {
    Problem problem = PointMassProblem();
    if (sweeps) problem.between = Curving(0, 0);
    EXPECT_TRUE(IsCertified(Judge(problem, rest, 4, {Approaching(2 - kHair, motion)}, schedule)));
    const Decision touched = Judge(problem, rest, 4, {Approaching(2 + kHair, motion)}, schedule);
    EXPECT_FIELDS(touched, (outcome, Outcome::kSafety), (step, sweeps ? 3 : 4));
    // A stamp a second before the plan's start: it is 4 m nearer.
    motion.stamp_us = 6'000'000;
    EXPECT_EQ(Judge(problem, rest, 4, {Approaching(2 - kHair, motion)}, schedule).step, sweeps ? 2 : 3);
    motion.stamp_us = 7'000'000;
  }
}

TEST(Moving, ClockErrorAndGrowthAddUp) {
  const Eigen::VectorXd rest = Vec({0, 0, 0, 0});
  const Problem problem = PointMassProblem();
  Schedule schedule{0, 500'000, 250'000};
  EXPECT_TRUE(IsCertified(Judge(problem, rest, 4, {Approaching(1 - kHair, AtFour())}, schedule)));  // 4 m/s, 0.25 s
  EXPECT_FALSE(IsCertified(Judge(problem, rest, 4, {Approaching(1 + kHair, AtFour())}, schedule)));
  schedule.clock_error_us = 0;
  ObstacleMotion motion = AtFour();
  motion.uncertainty = 0.25;
  motion.growth = 0.125;       // 0.25 after 2 s
  motion.growth_rate = 0.125;  // 0.25 after 2 s
  EXPECT_TRUE(IsCertified(Judge(problem, rest, 4, {Approaching(1.25 - kHair, motion)}, schedule)));
  EXPECT_FALSE(IsCertified(Judge(problem, rest, 4, {Approaching(1.25 + kHair, motion)}, schedule)));
  motion = {};
  motion.growth = 1;
  motion.stamp_us = 8'000'000;  // the plan ends 6 s before the stamp; its start is 8 s before
  EXPECT_TRUE(IsCertified(Judge(problem, rest, 4, {Approaching(2 - kHair, motion)}, schedule)));
  EXPECT_EQ(Judge(problem, rest, 4, {Approaching(2 + kHair, motion)}, schedule).step, 0);
}

TEST(Moving, CountsInItsWindowOnly) {
  const Eigen::VectorXd rest = Vec({0, 0, 0, 0});
  Problem problem = PointMassProblem();
  Schedule schedule{0, 500'000, 1'000};
  ObstacleMotion motion = AtFour();
  motion.velocity.setZero();
  const auto judge = [&](std::int64_t from, std::int64_t until) {
    motion.from_us = from;
    motion.until_us = until;
    return Judge(problem, rest, 4, {Obstacle::Circle(Vec({0, 0}), 1).Moving(motion)}, schedule).step;
  };
  EXPECT_EQ(judge(500'001 + 1'000, 999'999 - 1'000), -1);  // between two samples
  EXPECT_EQ(judge(500'000 + 1'000, 999'999 - 1'000), 1);
  EXPECT_EQ(judge(500'001 + 1'000, 1'000'000 - 1'000), 2);
  EXPECT_EQ(judge(-ObstacleMotion::kAlways, -1'001), -1);
  EXPECT_EQ(judge(-ObstacleMotion::kAlways, -1'000), 0);
  EXPECT_EQ(judge(2'001'001, ObstacleMotion::kAlways), -1);
  EXPECT_EQ(judge(2'001'000, ObstacleMotion::kAlways), 4);
  problem.between = Curving(0, 0);
  EXPECT_EQ(judge(500'001 + 1'000, 999'999 - 1'000), 1);
}

// They cross within one step: 1.4 m apart at both samples, at one place between them.
TEST(Moving, TheRelativeMotionIsSwept) {
  Problem problem = PointMassProblem();
  const Eigen::VectorXd start = Vec({0, 0, 4, 0});
  const Schedule schedule{0, 500'000, 0};
  ObstacleMotion motion;
  motion.velocity = Vector3d(0, 4, 0);
  const auto pedestrian = [&](double x, double radius) {
    return std::vector{Obstacle::Circle(Vec({x, -1}), radius).Moving(motion)};
  };
  EXPECT_TRUE(IsCertified(Judge(problem, start, 1, pedestrian(1, 1), schedule)));
  problem.between = Curving(0, 0);
  EXPECT_FALSE(IsCertified(Judge(problem, start, 1, pedestrian(1, 0), schedule)));
  // Relative to the pedestrian at x = 2 the robot moves from (-2, 1) to (0, -1), along x + y = -1.
  EXPECT_TRUE(IsCertified(Judge(problem, start, 1, pedestrian(2, std::sqrt(0.5) - kHair), schedule)));
  EXPECT_FALSE(IsCertified(Judge(problem, start, 1, pedestrian(2, std::sqrt(0.5) + kHair), schedule)));
}

TEST(Moving, AWallMovesToo) {
  const Problem problem = PointMassProblem();
  ObstacleMotion motion;
  motion.velocity = Vector3d(-1, 0, 0);
  const auto wall = [&](double offset) { return std::vector{Obstacle::HalfSpace(Vec({2, 0}), offset).Moving(motion)}; };
  const Schedule schedule{0, 500'000, 0};
  EXPECT_TRUE(IsCertified(Judge(problem, Vec({0, 0, 0, 0}), 2, wall(2 + kHair), schedule)));
  EXPECT_FALSE(IsCertified(Judge(problem, Vec({0, 0, 0, 0}), 2, wall(2 - kHair), schedule)));
}

TEST(Moving, NeedsASchedule) {
  const Problem problem = PointMassProblem();
  const std::vector<Obstacle> moving{Approaching(1, AtFour())};
  const Eigen::VectorXd rest = Vec({0, 0, 0, 0});
  EXPECT_THROW((void)Judge(problem, rest, 1, moving), std::invalid_argument);
  const std::int64_t latest = Schedule::kLatest, longest = Schedule::kLongest;
  for (const Schedule& bad :
       {Schedule{latest + 1, 1, 0}, Schedule{-latest - 1, 1, 0}, Schedule{0, longest + 1, 0}, Schedule{0, -1, 0},
        Schedule{0, 1, -1}, Schedule{0, 1, longest + 1}, Schedule{std::numeric_limits<std::int64_t>::min(), 1, 0}})
    EXPECT_THROW((void)Judge(problem, rest, 1, moving, bad), std::invalid_argument);
  // The extremes do not overflow: the obstacle is 4e12 m away, and the clock's error is worth 4e6 m.
  for (const std::int64_t start : {-latest, latest})
    EXPECT_TRUE(IsCertified(Judge(problem, rest, 100, moving, {start, longest, longest})));
}

TEST(Moving, RefusesAMalformedMotion) {
  const Obstacle disc = Obstacle::Circle(Vec({0, 0}), 1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [&](const std::function<void(ObstacleMotion&)>& change) {
    ObstacleMotion motion;
    change(motion);
    EXPECT_THROW((void)disc.Moving(motion), std::invalid_argument);
  };
  EXPECT_NO_THROW((void)disc.Moving({}));
  for (const double bad : {nan, kInfinity, -kInfinity}) refused([&](ObstacleMotion& m) { m.velocity[0] = bad; });
  refused([](ObstacleMotion& m) { m.velocity[2] = 1; });
  for (const double bad : {nan, kInfinity, -1e-300}) {
    refused([&](ObstacleMotion& m) { m.uncertainty = bad; });
    refused([&](ObstacleMotion& m) { m.growth = bad; });
    refused([&](ObstacleMotion& m) { m.growth_rate = bad; });
  }
  refused([](ObstacleMotion& m) { m.stamp_us = Schedule::kLatest + 1; });
  refused([](ObstacleMotion& m) { m.from_us = 1, m.until_us = 0; });
}

TEST(SafetyTest, BeginsAtTheGivenStep) {
  Problem problem = PointMassProblem();
  problem.between = Curving(0, 0);
  Certifier certifier(std::make_shared<Problem>(problem));
  Tube tube;
  const std::vector<double> controls(8, 0.0);
  const Plan plan{controls.data(), 2, 4, 2};
  ASSERT_TRUE(IsCertified(certifier.Certify(plan, Zonotope::FromBox(Vec({0, 0, 4, 0}), Vec({0, 0, 0, 0})), {}, tube)));
  const std::vector<Obstacle> behind{Obstacle::Circle(Vec({1, 0}), 0.5)};  // met in step 0 only
  EXPECT_EQ(certifier.safety().Judge(behind, {}, tube, 0).step, 0);
  const Decision later = certifier.safety().Judge(behind, {}, tube, 1);
  EXPECT_TRUE(IsCertified(later));
  EXPECT_NEAR(later.margin - later.threshold, 0.5, 1e-9);
  EXPECT_EQ(certifier.safety().Judge(behind, {}, tube, 4).obstacle, -1);
}

// Bodies and obstacles, more pairs of them than the search for the closest keeps, and fewer.
TEST(SafetyTest, NamesTheClosestOfAllStepsAndObstacles) {
  FreshRandom random;
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const std::vector<Body> bodies{
      {},
      Parts({{{Vector3d::Zero()}, 0.6}}, 2),
      Parts({{{Vector3d(1.4, 0, 0)}, 0.9}}, 2),
      Parts({{{Vector3d(2, 1, 0), Vector3d(-1, 1, 0), Vector3d(2, -1, 0), Vector3d(-1, -1, 0)}, 0.1},
             {{Vector3d(-3, 0, 0)}, 0.8}},
            2)};
  std::array<int, 3> certified{};
  for (int round = 0; round < 240; ++round) {
    Problem problem = BicycleProblem();
    problem.body = bodies[static_cast<std::size_t>(round % 4)];
    const bool is_point = round % 4 == 0, sweeps = round % 3 == 0;
    if (sweeps) problem.between = Curving(0.5, 0.5);
    const std::size_t size = static_cast<std::size_t>(round) % certified.size();
    std::vector<Obstacle> obstacles;
    for (int o = 0; o < std::array{1, 4, 40}[size]; ++o) {
      const double angle = uniform(-3, 3), away = uniform(8, 25);
      const Eigen::VectorXd at = Vec({5 + away * std::cos(angle), away * std::sin(angle)});
      obstacles.push_back(o % 2 == 0 ? Obstacle::Circle(at, uniform(0, 1))
                                     : Obstacle::AxisBox(at, at + Vec({uniform(0, 2), uniform(0, 2)})));
    }
    const Certifier certifier(std::make_shared<Problem>(problem));
    Tube tube;
    const std::vector<double> controls(8, 0.0);
    const auto set =
        Zonotope::FromBox(Vec({0, 0, 0, uniform(0, 6), 0, uniform(-0.2, 0.2)}), Vec({0.1, 0.1, 0.02, 0.1, 0, 0}));
    const Decision found = certifier.Certify({controls.data(), 2, 4, 2}, set, obstacles, tube);
    if (!IsCertified(found)) continue;
    ++certified[size];
    const auto clearance = [&](int t, int o) {
      return certifier.SeparateSlice(tube, t, obstacles[static_cast<std::size_t>(o)]).clearance();
    };
    double least = kInfinity;
    for (int t = 0; t < certifier.safety().NumUnits(tube); ++t)
      for (int o = 0; o < static_cast<int>(obstacles.size()); ++o) least = std::min(least, clearance(t, o));
    const double named = Separation{found.margin, found.threshold}.clearance();
    if (is_point) EXPECT_EQ(named, least) << round;
    EXPECT_NEAR(named, least, 1e-5) << round;  // how close to the distance a search for several pieces comes
    EXPECT_NEAR(clearance(found.closest_step, found.obstacle), least, 1e-5) << round;
  }
  EXPECT_THAT(certified, Each(Gt(10)));
}

// The support along any direction is above that of every place, and not above that of what encloses them.
TEST(Body, TheSupportOfAPartContainsItsPlaces) {
  FreshRandom random;
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (int round = 0; round < 300; ++round) {
    Body body = Parts({{{Vector3d(3, 1, 0), Vector3d(-1, uniform(-1, 1), 0)}, 0.3}, {{Vector3d(uniform(-3, 3), 0, 0)}}},
                      round % 3 == 0 ? -1 : 2);
    Between between = Curving(uniform(0, 1), uniform(0, 1));
    between.turn_rate = uniform(0, 1);
    const std::optional<Between> sweep = round % 2 == 0 ? std::optional(between) : std::nullopt;
    Eigen::MatrixXd projection = Eigen::MatrixXd::Identity(2, 4);
    projection(1, 3) = round % 5 == 0 ? 0.5 : 0;
    const Placement placement(projection, body, sweep, 4);
    const int m = round % 12;
    const Eigen::VectorXd center = Eigen::VectorXd::NullaryExpr(4, [&] { return uniform(-3, 3); });
    const Eigen::MatrixXd generators = Eigen::MatrixXd::NullaryExpr(4, m, [&] { return uniform(-0.1, 0.1); });
    const Zonotope slice(center, generators);
    std::array<double, 4> half_width;
    for (int k = 0; k < 4; ++k) half_width[static_cast<std::size_t>(k)] = slice.HalfWidthUpper(k);
    Placement::Sample sample;
    placement.Observe(slice, half_width, sample);
    std::vector<Zonotope> places(3);
    placement.Enclose(sample, places.data());
    Placement::Pose pose;
    placement.PoseOver(slice, half_width, pose);
    EXPECT_TRUE(pose.is_known);
    const double scale = std::exp2(uniform(-20, 20));
    const Vector3d d(scale * uniform(-1, 1), scale * uniform(-1, 1), 0);
    for (const Placement::Part& part : placement.parts()) {
      const double support = placement.SupportUpper(sample, part, d);
      double of_places = -kInfinity;
      for (int i = part.first; i < part.first + part.count; ++i)
        of_places = std::max(
            of_places, places[static_cast<std::size_t>(i)].SupportUpper({d.data(), 2}) + d.norm() * placement.turn(i));
      EXPECT_NEAR(support, of_places, 1e-11 * scale) << round;
      const auto& width = pose.width;
      double of_pose = -kInfinity;
      for (std::size_t i = ToSize(part.first); i < ToSize(part.first + part.count); ++i)
        of_pose = std::max(of_pose, d[0] * pose.middle[0][i] + d[1] * pose.middle[1][i] + d.norm() * pose.around[i] +
                                        std::abs(d[0]) * width[0] + std::abs(d[1]) * width[1]);
      EXPECT_GE(of_pose, of_places - 1e-11 * scale) << round;
      EXPECT_EQ(placement.SupportUpper(sample, part, d, InstructionSet::kBaseline), support);
      const double length = d.norm();
      Placement::Farthest farthest;
      placement.FindFarthest(pose, slice, part, {d[0] / length, d[1] / length}, farthest);
      EXPECT_GE(farthest.support, of_places / length - 1e-11) << round;
      EXPECT_LE(farthest.support, of_pose / length + 1e-11) << round;
      for (int trial = 0; trial < 8; ++trial) {  // the point is one of the places
        const Vector3d e = trial == 0 ? Vector3d(d / length) : Vector3d(uniform(-1, 1), uniform(-1, 1), 0);
        const double most = placement.SupportUpper(sample, part, e);
        EXPECT_LE(e[0] * farthest.x + e[1] * farthest.y, most + 1e-11) << round;
      }
      const Placement::Farthest before = farthest;
      placement.FindFarthest(pose, slice, part, {d[0] / length, d[1] / length}, farthest);  // no farther
      EXPECT_FIELDS(farthest, (support, before.support), (x, before.x), (y, before.y));
      const BodyPart& points = body.parts[part.first == 0 ? 0 : 1];
      for (int trial = 0; trial < 20; ++trial) {
        const Eigen::VectorXd signs = Eigen::VectorXd::NullaryExpr(m, [&] { return uniform(0, 1) < 0.5 ? -1.0 : 1.0; });
        using Wide = Eigen::Matrix<long double, Eigen::Dynamic, 1>;
        const Wide x = center.cast<long double>() + generators.cast<long double>() * signs.cast<long double>();
        const long double theta = body.heading < 0 ? 0 : x[2], c = std::cos(theta), s = std::sin(theta);
        const Wide p = projection.cast<long double>() * x;
        for (const Vector3d& q : points.points)
          EXPECT_LE(d[0] * (p[0] + c * q[0] - s * q[1]) + d[1] * (p[1] + s * q[0] + c * q[1]), support) << round;
      }
    }
  }
}

TEST(Body, SupportIsUnboundedForAVeryLargeHeading) {
  const Placement placement(Eigen::MatrixXd::Identity(2, 3), Parts({{{Vector3d(1, 0, 0)}, 0}}, 2), std::nullopt, 3);
  const std::array<double, 3> half_width{};
  Placement::Sample sample;
  for (const double heading : {0x1p20, 0x1.1p20}) {
    const auto slice = Zonotope::FromBox(Vec({0, 0, heading}), Vec({0, 0, 0}));
    placement.Observe(slice, half_width, sample);
    EXPECT_EQ(placement.SupportUpper(sample, placement.parts()[0], Vector3d(1, 0, 0)) < 2, heading == 0x1p20);
    Placement::Pose pose;
    placement.PoseOver(slice, half_width, pose);
    EXPECT_EQ(pose.is_known, heading == 0x1p20);
  }
}

TEST(Body, ItsSidesPointOutward) {
  std::vector<Vector3d> points{{3, 1, 0}, {-1, 2, 0}, {-2, -1, 0}, {2, -1, 0}};
  for (int order = 0; order < 2; ++order, std::ranges::reverse(points)) {
    const Placement placement(Eigen::MatrixXd::Identity(2, 3), Parts({{points, 0}}, 2), std::nullopt, 3);
    Placement::Pose pose;
    placement.PoseOver(Zonotope::FromBox(Vec({5, 6, 0.7}), Vec({0, 0, 0})), std::array<double, 3>{}, pose);
    for (int i = 0; i < 4; ++i) {
      const std::array<double, 2> side = placement.Side(pose, placement.parts()[0], i);
      EXPECT_NEAR(std::hypot(side[0], side[1]), 1, 1e-15);
      const auto along = [&](int j) {
        return side[0] * pose.middle[0][ToSize(j)] + side[1] * pose.middle[1][ToSize(j)];
      };
      EXPECT_NEAR(along(i), along((i + 1) % 4), 1e-14);
      EXPECT_LT(along((i + 2) % 4), along(i) - 0.5);
    }
  }
}

TEST(SeparateAlong, IsABoundForAnyDirectionOfAnyLength) {
  const Obstacle circle = Obstacle::Circle(Vec({3, 4}), 1);
  for (const double scale : {1.0, 1e-30, 1e30, 0.3}) {
    const Vector3d d(3 * scale, 4 * scale, 0);
    EXPECT_LE(DistanceLower(circle, d, 0), 5);
    EXPECT_NEAR(DistanceLower(circle, d, 0), 5, 1e-12);
    EXPECT_NEAR(DistanceLower(circle, d, 20 * scale), 1, 1e-12);
    EXPECT_EQ(DistanceLower(circle, d, 25 * scale), -kInfinity);
    EXPECT_EQ(DistanceLower(circle, -d, 0), -kInfinity);
    const Obstacle wall = Obstacle::HalfSpace(Vec({3 * scale, 4 * scale}), 10 * scale);
    EXPECT_LE(DistanceLower(wall, d, 0), 2);
    EXPECT_NEAR(DistanceLower(wall, d, 0), 2, 1e-12);
  }
  for (const double none : {std::nan(""), kInfinity})
    EXPECT_EQ(DistanceLower(circle, Vector3d(3, 4, 0), none), -kInfinity);
  for (const double bad : {0.0, 0x1p-420, 0x1p420, kInfinity, std::nan("")})
    EXPECT_EQ(DistanceLower(circle, Vector3d(bad, 0, 0), -1), -kInfinity) << bad;
  EXPECT_EQ(DistanceLower(circle, Vector3d(1, 0, 0), -kInfinity), -kInfinity) << "no bound is infinite";
}

// Against the best of many directions: what the search claims is a bound, and nearly the best one.
TEST(SeparatePieces, FindsTheDistanceOfTheirHull) {
  std::mt19937_64 random(20261123);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal;
  for (const int p : {2, 3}) {
    int proven = 0;
    for (int trial = 0; trial < 200; ++trial) {
      const int count = 1 + trial % 5;
      std::vector<Zonotope> sets;
      std::vector<Piece> pieces;
      for (int i = 0; i < count; ++i) {
        Eigen::VectorXd center(p);
        Eigen::MatrixXd generators(p, 1 + trial % 4);
        for (double& x : center.reshaped()) x = 2 * uniform(random);
        for (double& x : generators.reshaped()) x = 0.3 * uniform(random);
        sets.emplace_back(center, generators);
      }
      for (int i = 0; i < count; ++i) {
        Piece& piece = pieces.emplace_back();
        piece.set = &sets[static_cast<std::size_t>(i)];
        piece.ball = trial % 3 == 0 ? 0 : 0.1 * std::abs(uniform(random));
        for (int k = 0; k < p; ++k) piece.shift[static_cast<std::size_t>(k)] = Interval(uniform(random));
      }
      Eigen::VectorXd lower(p), upper(p);
      for (int k = 0; k < p; ++k) {
        lower[k] = 4 * uniform(random);
        upper[k] = lower[k] + std::abs(uniform(random));
      }
      const Obstacle box = Obstacle::AxisBox(lower, upper);
      double best = -kInfinity;
      const auto consider = [&](const Vector3d& d) {
        double value = kInfinity;
        for (const Vector3d& point : box.hull()) value = std::min(value, d.dot(point));
        double support = -kInfinity;
        for (const Piece& piece : pieces) {
          double its = piece.ball;
          for (int k = 0; k < p; ++k)
            its += d[k] * (piece.set->center(k) - piece.shift[static_cast<std::size_t>(k)].lower);
          for (int j = 0; j < piece.set->num_generators(); ++j) {
            double along = 0;
            for (int k = 0; k < p; ++k) along += d[k] * piece.set->generator(k, j);
            its += std::abs(along);
          }
          support = std::max(support, its);
        }
        best = std::max(best, value - support);
      };
      Vector3d d = Vector3d::Zero();
      if (p == 2) {
        for (int i = 0; i < 3600; ++i) consider({std::cos(i * M_PI / 1800), std::sin(i * M_PI / 1800), 0});
      } else {
        for (int i = 0; i < 20000; ++i) {
          for (int k = 0; k < 3; ++k) d[k] = normal(random);
          consider(d.normalized());
        }
      }
      const Separation found = Separate(pieces, box, 0.25);
      EXPECT_EQ(found.threshold, 0.25);
      if (best <= 0.01) continue;
      ++proven;
      EXPECT_GE(found.distance, best - 1e-7) << "p " << p << " trial " << trial;
      for (int i = 0; i < 200; ++i) {  // no point of the hull is nearer to the core
        const auto& [set, ball, shift] = pieces[static_cast<std::size_t>(random() % pieces.size())];
        Vector3d apart = box.hull()[random() % box.hull().size()];
        for (int k = 0; k < p; ++k) apart[k] -= set->center(k) - shift[static_cast<std::size_t>(k)].lower;
        for (int j = 0; j < set->num_generators(); ++j) {
          const double sign = random() % 2 == 0 ? 1 : -1;
          for (int k = 0; k < p; ++k) apart[k] -= sign * set->generator(k, j);
        }
        ASSERT_GE(apart.norm() - ball, found.distance - 1e-12) << "p " << p << " trial " << trial;
      }
    }
    EXPECT_GT(proven, 50);
  }
}

TEST(HullJoin, ContainsBothAndIsUnboundedForNan) {
  const Hull a{{0, 1, 0}, {1, 0.5, 0}}, b{{3, 1, 0}, {0.5, 0.25, 0}};
  const Hull joined = Join(a, b, 2);
  EXPECT_EQ(joined.center[0] - joined.half_width[0], -1);
  EXPECT_EQ(joined.center[0] + joined.half_width[0], 3.5);
  EXPECT_EQ(joined.half_width[1], 0.5);
  const Obstacle far = Obstacle::Circle(Vec({100, 0}), 1);
  EXPECT_TRUE(SeparateHulls(joined, far).IsProven());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double none : {nan, kInfinity, -kInfinity})
    for (const Hull& bad : {Hull{{none, 1, 0}, {1, 1, 0}}, Hull{{0, 1, 0}, {none, 1, 0}}})
      for (const Hull& both : {Join(a, bad, 2), Join(bad, a, 2)}) {
        EXPECT_EQ(both.half_width[0], kInfinity);
        EXPECT_FALSE(SeparateHulls(both, far).IsProven());
      }
}

// Two points 1.7 m apart in space: their segment passes the obstacle, a point, at a distance of sqrt(2 / 3).
TEST(SeparatePieces, DecidesASegmentInSpaceWithinAHair) {
  Problem problem = PointMassProblem();
  problem.projection = Eigen::MatrixXd::Identity(3, 4);
  problem.body = Parts({{{Vector3d(0, 0, 0), Vector3d(1, 1, 1)}, 0}});
  const Eigen::VectorXd rest = Vec({0, 0, 0, 0});
  const Obstacle box = Obstacle::AxisBox(Vec({1, 0, 0}), Vec({1, 0, 0}));
  for (const double gap : {kHair, -kHair}) {
    problem.body.parts[0].radius = std::sqrt(2.0 / 3) - gap;
    EXPECT_EQ(IsCertified(Judge(problem, rest, 1, {box})), gap > 0) << gap;
  }
}

}  // namespace forereach::sweep_test
