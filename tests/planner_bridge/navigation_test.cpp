#include "planner_bridge/navigation.h"

#include "tests/test.h"

#include "tests/planner_bridge/tasks.h"

namespace forereach::navigation_test {

const Box kRegion(Vec({-50, -50}), Vec({50, 50}));

TEST(NavigationField, IsTheStraightDistanceWithoutObstacles) {
  const NavigationField field(kRegion, RoomOfPoint({}), 0.5, Vec({10, 5}));
  for (const Eigen::VectorXd& y : {Vec({-30, 5}), Vec({10, -20}), Vec({-11, 26}), Vec({25, 12})})
    EXPECT_NEAR(field.DistanceToGo(y), (y - Vec({10, 5})).norm(), 0.05 * (y - Vec({10, 5})).norm() + 0.5);
}

TEST(NavigationField, AnObstacleCostsADetour) {
  const std::vector<Obstacle> wall{Obstacle::AxisBox(Vec({-1, -20}), Vec({1, 20}))};
  const NavigationField field(kRegion, RoomOfPoint(wall), 0.5, Vec({20, 0}));
  const double around = 2 * std::hypot(20, 20);
  EXPECT_GT(field.DistanceToGo(Vec({-20, 0})), 0.98 * around);
  EXPECT_LT(field.DistanceToGo(Vec({-20, 0})), 1.2 * around);
}

TEST(RoomOfPoint, IsThatOfWhatStandsAtTheTime) {
  ObstacleMotion until_taken_away;
  until_taken_away.until_us = 9'000'000;
  ObstacleMotion driving;
  driving.velocity = {1, 0, 0};
  const Obstacle circle = Obstacle::Circle(Vec({0, 0}), 8);
  const std::vector<Obstacle> obstacles{circle.Moving(until_taken_away), circle.Moving(driving)};
  EXPECT_EQ(RoomOfPoint(obstacles, 9'000'000)(Vec({10, 0})), 2);
  EXPECT_EQ(RoomOfPoint(obstacles, 9'000'001)(Vec({10, 0})), std::numeric_limits<double>::infinity());
}

TEST(NavigationField, FollowingTheDescentReachesTheGoalAndKeepsOutOfObstacles) {
  constexpr std::uint32_t kSeed = 5;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> coordinate(-40, 40);
  const std::vector<Obstacle> obstacles{Obstacle::Circle(Vec({0, 0}), 8), Obstacle::Circle(Vec({15, 12}), 5)};
  const NavigationField field(kRegion, RoomOfPoint(obstacles), 1, Vec({30, 20}));
  for (int i = 0; i < 50; ++i) {
    Eigen::VectorXd y = Vec({coordinate(random), coordinate(random)});
    const bool inside = ApproximateDistance(obstacles[0], y) < 1 || ApproximateDistance(obstacles[1], y) < 1;
    for (int step = 0; step < 1000 && (y - Vec({30, 20})).norm() > 1; ++step) {
      y += 0.2 * field.Descent(y);
      for (const Obstacle& obstacle : obstacles)
        EXPECT_TRUE(inside || ApproximateDistance(obstacle, y) > 0) << y.transpose();
    }
    EXPECT_LE((y - Vec({30, 20})).norm(), 1);
  }
}

TEST(NavigationField, IsFiniteEvenInsideAnObstacleAndOutsideTheRegion) {
  const NavigationField field(kRegion, RoomOfPoint({Obstacle::Circle(Vec({0, 0}), 8)}), 1, Vec({30, 20}));
  for (const Eigen::VectorXd& y : {Vec({0, 0}), Vec({500, 0}), Vec({-60, 90})}) {
    EXPECT_TRUE(std::isfinite(field.DistanceToGo(y)));
    EXPECT_TRUE(field.Descent(y).allFinite());
  }
}

TEST(NavigationField, AGoalOutsideTheRegionIsApproached) {
  const NavigationField field(kRegion, RoomOfPoint({}), 1, Vec({100, 0}));
  EXPECT_TRUE(std::isfinite(field.DistanceToGo(Vec({0, 0}))));
  EXPECT_GT(field.Descent(Vec({0, 0}))(0), 0.99);
}

TEST(NavigationField, IsTheDistanceInOneDimension) {
  const NavigationField field(Box(Vec({-5}), Vec({5})), RoomOfPoint({}), 0.5, Vec({2}));
  EXPECT_DOUBLE_EQ(field.DistanceToGo(Vec({-3})), 5);
  EXPECT_DOUBLE_EQ(field.Descent(Vec({-3}))(0), 1);
}

}  // namespace forereach::navigation_test
