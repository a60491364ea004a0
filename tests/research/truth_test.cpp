// Rollouts of the target: where they start, that they are the target's, and when they touch.
#include "research/truth.h"

#include "tests/test.h"

namespace forereach::research::truth_test {

TEST(Rollouts, StartAtTheCenterThenAtEachCornerThenInside) {
  for (const System* system : Systems()) {
    const Scenario scenario = MakeScenario(*system, Group::kC, 0, 0);
    const int n = system->num_states(), corners = 1 << n;
    const Rollouts rollouts(*system, scenario, corners + 21);
    std::vector<bool> seen(static_cast<std::size_t>(corners), false);
    for (int i = 0; i < rollouts.count(); ++i) {
      std::size_t corner = 0;
      int extremes = 0;
      for (int k = 0; k < n; ++k) {
        const double center = scenario.center[k], half_width = system->initial_half_width[k];
        const double x = rollouts.state(i, 0)[static_cast<std::size_t>(k)];
        if (i == 0) EXPECT_EQ(x, center);
        EXPECT_LE(x, center + half_width);
        EXPECT_GE(x, center - half_width);
        extremes += x == center + half_width || x == center - half_width;
        if (x == center + half_width) corner |= std::size_t{1} << k;
      }
      EXPECT_EQ(extremes, 1 <= i && i <= corners ? n : 0) << i;
      if (1 <= i && i <= corners) seen[corner] = true;
    }
    for (const bool one : seen) EXPECT_TRUE(one);
  }
}

TEST(Rollouts, AreTheTargetsWithItsResidual) {
  const System& system = BicycleSystem();
  const Scenario scenario = MakeScenario(system, Group::kC, 0, 1);
  const Rollouts rollouts(system, scenario, 3);
  double largest = 0;
  for (int i = 0; i < rollouts.count(); ++i)
    for (int t = 0; t < rollouts.horizon(); ++t) {
      std::vector<double> z(rollouts.state(i, t).begin(), rollouts.state(i, t).end()), nominal(6);
      for (int j = 0; j < 2; ++j) z.push_back(scenario.controls(j, t));
      system.model->Evaluate(z, nominal);
      for (std::size_t k = 0; k < 6; ++k) {
        EXPECT_NEAR(rollouts.state(i, t + 1)[k], nominal[k] + rollouts.residual(i, t)[k], 1e-13);
        largest = std::max(largest, std::abs(rollouts.residual(i, t)[k]));
      }
    }
  EXPECT_GT(largest, 1e-4);  // in C the tyres saturate
}

TEST(Rollouts, ACircleThatIsMetExactlyIsTouched) {
  const System& system = PointMassSystem();
  const Scenario scenario = MakeScenario(system, Group::kC, 0, 0);
  const Rollouts path(system, scenario, 1);
  const auto end = path.state(0, 12);
  const Eigen::Vector2d beyond(end[0] + 2, end[1]);  // straight ahead of where the path ends
  const double distance = std::hypot(end[0] - beyond.x(), end[1] - beyond.y());
  EXPECT_FALSE(path.StayClearOf({beyond, distance}));
  EXPECT_TRUE(path.StayClearOf({beyond, std::nextafter(distance, 0)}));
}

}  // namespace forereach::research::truth_test
