// Scenarios: in their groups' bounds, half of them unsafe, the obstacle where it is said to be.
#include "research/scenarios.h"

#include "tests/test.h"

#include "research/truth.h"

namespace forereach::research::scenarios_test {

constexpr int kCount = 200;

// The least distance from the obstacle's center to the rollout from X0's center at steps 9..12.
double DistanceFromPath(const System& system, const Scenario& scenario) {
  const Rollouts path(system, scenario, 1);
  double least = std::numeric_limits<double>::infinity();
  for (int t = 9; t <= 12; ++t) {
    const auto x = path.state(0, t);
    least = std::min(least, (Eigen::Vector2d(x[0], x[1]) - scenario.obstacle.center).norm());
  }
  return least;
}

TEST(Scenarios, AreTheSameEachTimeAndOthersOtherwise) {
  for (const System* system : Systems()) {
    const Scenario a = MakeScenario(*system, Group::kC, 2, 7), b = MakeScenario(*system, Group::kC, 2, 7);
    EXPECT_FIELDS(a, (center, b.center), (controls, b.controls), (obstacle.center, b.obstacle.center));
    EXPECT_NE(a.center, MakeScenario(*system, Group::kC, 2, 8).center);
    EXPECT_NE(a.center, MakeScenario(*system, Group::kC, 3, 7).center);
  }
}

TEST(Scenarios, BicyclesAreInTheirBounds) {
  for (const Group group : kGroups)
    for (int i = 0; i < kCount; ++i) {
      const Scenario s = MakeScenario(BicycleSystem(), group, 0, i);
      const double delta = group == Group::kB ? -s.center[5] : s.center[5];
      EXPECT_GE(delta, group == Group::kA ? 0.04 : 0.25);
      EXPECT_LE(delta, group == Group::kA ? 0.12 : 0.40);
      EXPECT_GE(s.center[3], 9);
      EXPECT_LE(s.center[3], 15);
      EXPECT_EQ(s.controls.cols(), 12);
      EXPECT_LE(s.controls.row(0).cwiseAbs().maxCoeff(), 0.5);
      EXPECT_LE(s.controls.row(1).cwiseAbs().maxCoeff(), 0.05);
      EXPECT_FIELDS(s, (controls.col(0), s.controls.col(11)), (obstacle.radius, 1));
    }
}

TEST(Scenarios, PointMassesAreInTheirBounds) {
  for (const Group group : kGroups)
    for (int i = 0; i < kCount; ++i) {
      const Scenario s = MakeScenario(PointMassSystem(), group, 0, i);
      const double vx = group == Group::kB ? -s.center[2] : s.center[2];
      EXPECT_GE(vx, group == Group::kA ? 0.1 : 1);
      EXPECT_LE(vx, group == Group::kA ? 0.8 : 3);
      EXPECT_LE(std::abs(s.center[3]), 0.4);
      EXPECT_LE(s.controls.cwiseAbs().maxCoeff(), 0.3);
      EXPECT_EQ(s.obstacle.radius, 0.8);
    }
}

TEST(Scenarios, OddOnesMeetTheTargetsPathAndEvenOnesAreMovedOffIt) {
  for (const System* system : Systems())
    for (const Group group : kGroups)
      for (int i = 0; i < kCount; ++i) {
        const Scenario s = MakeScenario(*system, group, 1, i);
        const double least = system == &BicycleSystem() ? 0.5 : 0.6, largest = system == &BicycleSystem() ? 2.5 : 1.6;
        const double distance = DistanceFromPath(*system, s);
        if (i % 2 == 1) {
          EXPECT_LE(distance, 0.8 * s.obstacle.radius + 1e-12);
        } else {
          EXPECT_LE(distance, s.obstacle.radius + largest + 1e-12);
          // Beside step k; a later step of a curve may come a little closer.
          EXPECT_GT(distance, s.obstacle.radius + 0.5 * least);
        }
      }
}

TEST(Scenarios, HalfOfThemAreTargetSafe) {
  for (const System* system : Systems())
    for (const Group group : kGroups) {
      int safe = 0;
      for (int i = 0; i < kCount; ++i) {
        const Scenario s = MakeScenario(*system, group, 0, i);
        safe += Rollouts(*system, s, 70).StayClearOf(s.obstacle);
      }
      EXPECT_EQ(safe, kCount / 2) << system->name << " " << NameOf(group);
    }
}

TEST(Scenarios, TheObstacleIsOutsideTheCurve) {
  for (int i = 0; i < kCount; ++i) {
    // C curves to the left, so the circle is to the right of the path; B is C's mirror image.
    for (const Group group : {Group::kB, Group::kC}) {
      const Scenario s = MakeScenario(BicycleSystem(), group, 0, 2 * i);
      const Rollouts path(BicycleSystem(), s, 1);
      const auto before = path.state(0, 10), at = path.state(0, 11);
      const Eigen::Vector2d along(at[0] - before[0], at[1] - before[1]);
      const Eigen::Vector2d to_circle = s.obstacle.center - Eigen::Vector2d(at[0], at[1]);
      const double left = along.x() * to_circle.y() - along.y() * to_circle.x();
      EXPECT_TRUE(group == Group::kC ? left < 0 : left > 0);
    }
  }
}

}  // namespace forereach::research::scenarios_test
