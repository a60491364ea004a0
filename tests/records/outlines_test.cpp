// What a picture shows of a body: a sweep contains the body at every sample that it spans, and predictions grow.
#include "records/outlines.h"

#include "tests/test.h"

#include "forereach/certify/tube.h"
#include "tests/worlds.h"

namespace forereach::outlines_test {

using Eigen::Vector2d;

// Counter-clockwise, with what rounding may cost.
bool Contains(const Svg::Points& polygon, const Vector2d& point) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d edge = polygon[(i + 1) % polygon.size()] - polygon[i], away = point - polygon[i];
    if (edge.x() * away.y() - edge.y() * away.x() < -1e-9) return false;
  }
  return true;
}

TEST(Outlines, HullsAreCounterClockwiseAndConvex) {
  const Svg::Points square = HullOf({{1, 1}, {0, 0}, {0.5, 0.5}, {1, 0}, {0, 1}, {0.5, 0}});
  EXPECT_EQ(square, (Svg::Points{{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
  EXPECT_EQ(HullOf({{1, 2}}), (Svg::Points{{1, 2}}));
  const Svg::Points disc = HullOf({{1, 2}}, 0.5);
  EXPECT_EQ(disc.size(), 16u);
  for (const Vector2d& corner : disc) EXPECT_NEAR((corner - Vector2d(1, 2)).norm(), 0.5, 1e-12);
}

// The hull of all discs reaches as far in each direction as the farthest of them, and no farther; doubled points,
// points in one line and inner ones change nothing.
TEST(Outlines, AHullOfDiscsReachesAsFarAsTheFarthestDisc) {
  FreshRandom random;
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Vector2d> points;
    for (int i = 0; i < 1 + trial % 40; ++i) points.emplace_back(uniform(random), trial % 3 == 0 ? 0 : uniform(random));
    if (trial % 5 == 0) points.push_back(points.front());
    const double radius = 0.1 + std::abs(uniform(random));
    const Svg::Points disc = HullOf({Vector2d::Zero()}, radius), hull = HullOf(points, radius);
    const auto reach = [](const std::vector<Vector2d>& of, const Vector2d& direction) {
      double most = -kInfinity;
      for (const Vector2d& point : of) most = std::max(most, point.dot(direction));
      return most;
    };
    for (double angle = 0; angle < 2 * M_PI; angle += 0.01) {
      const Vector2d direction(std::cos(angle), std::sin(angle));
      EXPECT_NEAR(reach(hull, direction), reach(points, direction) + reach(disc, direction), 1e-12);
    }
  }
}

Problem Car() {
  Problem problem = WorldOf(MakeKinematicBicycle(0.1, 2.5), Within({100, 100, 3, 20, 3, 0.5}), Within({1, 1}));
  problem.body = {.heading = 2, .parts = {{{{-1, -1, 0}, {3, -1, 0}, {3, 1, 0}, {-1, 1, 0}}, 0}, {{{4, 0, 0}}, 0.5}}};
  return problem;
}

TEST(Outlines, ABodyAtAStateIsDrawnPartByPart) {
  const Problem car = Car();
  const Eigen::VectorXd x{{10, 20, M_PI / 2, 0, 0, 0}};
  const auto parts = BodyAt(car, x);
  ASSERT_EQ(parts.size(), 2u);
  ASSERT_EQ(parts[0].size(), 4u);
  EXPECT_NEAR(parts[0][0].x(), 9, 1e-12);
  EXPECT_NEAR(parts[0][0].y(), 19, 1e-12);
  EXPECT_TRUE(Contains(parts[1], {10, 24.49}));
  EXPECT_FALSE(Contains(parts[1], {10, 24.51}));
  Problem point = car;
  point.body = Body{};
  EXPECT_TRUE(BodyAt(point, x).empty());
}

TEST(Outlines, ASweepContainsTheBodyAtItsSamples) {
  for (const bool sweeps : {false, true}) {
    auto problem = std::make_shared<Problem>(Car());
    if (sweeps) problem->between = Between{Vector2d(5, 5), 2, 2, 0.1};
    const Certifier certifier(problem);
    const Eigen::VectorXd start{{0, 0, 0, 10, 0, 0.3}};
    const std::vector<double> controls(2 * 5, 0.0);
    const Plan plan{controls.data(), 2, 5, 2};
    Tube tube;
    ASSERT_EQ(certifier.Certify(plan, Zonotope::FromBox(start, Eigen::VectorXd::Zero(6)), {}, tube).outcome,
              Outcome::kCertified);
    const auto all = Sweeps(certifier, tube, tube.length());
    ASSERT_EQ(all.size(), sweeps ? 5u : 6u);
    EXPECT_EQ(Sweeps(certifier, tube, 2).size(), 3u);
    for (std::size_t t = 0; t < all.size(); ++t) {
      ASSERT_EQ(all[t].size(), 2u);
      for (int sample = static_cast<int>(t); sample <= static_cast<int>(t) + (sweeps ? 1 : 0); ++sample) {
        Eigen::VectorXd x(6);
        for (int k = 0; k < 6; ++k) x[k] = tube.slice(sample).center(k);
        const auto body = BodyAt(*problem, x);
        for (std::size_t part = 0; part < 2; ++part)
          for (const Vector2d& corner : body[part]) EXPECT_TRUE(Contains(all[t][part], corner)) << t << " " << sample;
      }
    }
  }
}

TEST(Outlines, PredictionsGrowWhereTheObstacleIs) {
  const Obstacle circle = Obstacle::Circle(Vector2d(1, 0), 0.5);
  EXPECT_TRUE(PredictionOf(circle, 0).empty());
  const ObstacleMotion motion{.stamp_us = 1'000'000, .velocity = {2, 0, 0}, .uncertainty = 0.25, .growth = 0.5};
  const auto seen = PredictionOf(circle.Moving(motion), motion.stamp_us);
  ASSERT_EQ(seen.size(), 5u) << "0, 0.5, .. 2 s";
  EXPECT_TRUE(Contains(seen[0], {1.74, 0}));
  EXPECT_FALSE(Contains(seen[0], {1.76, 0}));
  EXPECT_TRUE(Contains(seen[4], {5 + 1.74, 0}));
  EXPECT_FALSE(Contains(seen[4], {5 + 1.76, 0}));
  ObstacleMotion brief = motion;
  brief.from_us = 1'200'000, brief.until_us = 2'000'000;
  EXPECT_EQ(PredictionOf(circle.Moving(brief), motion.stamp_us).size(), 2u) << "at 0.5 and 1 s";
  EXPECT_TRUE(PredictionOf(Obstacle::HalfSpace(Vector2d(1, 0), 3).Moving(motion), motion.stamp_us).empty());
}

TEST(Outlines, AnObstacleThatMayBeAnywhereIsDrawnAsFarAsDrawingsGo) {
  Svg svg({Vector2d(-1, -1), Vector2d(1, 1)});
  const ObstacleMotion motion{.stamp_us = 1'000'000, .velocity = {2, 0, 0}, .growth_rate = 1e308};
  for (const Obstacle& obstacle :
       {Obstacle::Circle(Vector2d(1, 0), 0.5), Obstacle::AxisBox(Vector2d(0, 0), Vector2d(1, 1))})
    DrawObstacle(obstacle.Moving(motion), {1e6, 1e9}, {Vector2d(-1, -1), Vector2d(1, 1)}, "", svg);
  const std::string text = svg.Done();
  EXPECT_THAT(text, testing::Not(testing::HasSubstr("inf")));
  EXPECT_THAT(text, testing::Not(testing::HasSubstr("nan")));
}

}  // namespace forereach::outlines_test
