// Factors found by bisection hold, and just below them they do not.
#include "research/witness.h"

#include "tests/test.h"

#include "research/noise_floor.h"
#include "research/variants.h"

namespace forereach::research::witness_test {

TEST(FactorForContainment, HoldsAndFailsJustBelow) {
  const Undeclared kept{Escaping(32), PointMassSystem().deployed};
  const Undeclared small{BicycleSystem(), BicycleSystem().deployed / 31.710};
  int found = 0;
  for (const Undeclared* task : {&kept, &small})
    for (const int index : {1, 3}) {
      const Scenario scenario = MakeScenario(task->system, Group::kC, 0, index);
      const auto needed = FactorForContainment(*task, scenario);
      if (!needed) continue;
      ++found;
      EXPECT_TRUE(task->Contains(scenario, needed->factor));
      EXPECT_FALSE(task->Contains(scenario, needed->too_small));
      EXPECT_LT(needed->too_small, needed->factor);
      EXPECT_GT(needed->too_small, needed->factor * (1 - 2e-5));
      // Far from the bracket, too, and by both measures a larger declaration was due.
      EXPECT_FALSE(task->Contains(scenario, needed->factor / 2));
      EXPECT_TRUE(task->Contains(scenario, 2 * needed->factor));
      EXPECT_GT(needed->factor, 1);
      EXPECT_GT(task->EmpiricalFactor(scenario), 1);
    }
  EXPECT_EQ(found, 4);
}

TEST(FactorForContainment, ScalesWithTheDeclaration) {
  const Scenario scenario = MakeScenario(BicycleSystem(), Group::kC, 0, 1);
  const auto whole = FactorForContainment({BicycleSystem(), BicycleSystem().deployed / 10}, scenario),
             half = FactorForContainment({BicycleSystem(), BicycleSystem().deployed / 20}, scenario);
  ASSERT_TRUE(whole && half);
  EXPECT_NEAR(half->factor, 2 * whole->factor, 1e-3 * whole->factor);
  EXPECT_NEAR(Undeclared({BicycleSystem(), BicycleSystem().deployed / 20}).EmpiricalFactor(scenario),
              2 * Undeclared({BicycleSystem(), BicycleSystem().deployed / 10}).EmpiricalFactor(scenario), 1e-9);
}

TEST(Undeclared, TheDeployedMatrixContainsTheTarget) {
  for (const System* system : Systems()) {
    const Undeclared task{*system, system->deployed};
    for (const int index : {0, 1, 2}) {
      const Scenario scenario = MakeScenario(*system, Group::kC, 0, index);
      EXPECT_TRUE(task.Contains(scenario, 1));
      EXPECT_LE(task.EmpiricalFactor(scenario), 1);
    }
    EXPECT_FALSE(task.IsContradicted());
    EXPECT_FALSE(task.IsContradicted(0.01));
  }
}

TEST(Undeclared, AKeptDeclarationCertifiesWhatIsFalseAndIsNotContradicted) {
  const System system = NextToTheKnee(64);
  const Undeclared kept{system, PointMassSystem().deployed}, valid{system, system.deployed};
  Scenario scenario = ThroughTheKnee(system, 0);
  int certificates = 0;
  for (int step = 1; step <= system.horizon; ++step) {
    constexpr double kRadius = 0.1;
    scenario.obstacle = PlaceBeside(system, scenario.center, scenario.controls, step, 0.9 * kRadius, kRadius);
    EXPECT_FALSE(Rollouts(system, scenario, 40).StayClearOf(scenario.obstacle));
    certificates += kept.Certify(scenario).decision.outcome == Outcome::kCertified;
    EXPECT_NE(valid.Certify(scenario).decision.outcome, Outcome::kCertified);
  }
  EXPECT_GT(certificates, 0);
  EXPECT_FALSE(kept.IsContradicted());
  EXPECT_FALSE(kept.Contains(scenario, 1));
}

TEST(Undeclared, NoiseIsDeclaredAndBounded) {
  // Were the noise larger than what is declared, two observations of the flat residual would contradict it.
  const Undeclared task{BicycleSystem(), BicycleSystem().deployed / 100};
  for (const double sigma : {1e-3, 0.1}) EXPECT_FALSE(task.IsContradicted(sigma));
}

TEST(NoiseFloor, BothSystemsLieInTheTubeAndApartByTheNoise) {
  for (const System* system : Systems()) {
    const NoiseFloor fine = FindNoiseFloor(*system, 1e-4), coarse = FindNoiseFloor(*system, 1e-3);
    EXPECT_EQ(fine.escapes + coarse.escapes, 0);
    EXPECT_GT(fine.half_distance, 1e-4 * std::sqrt(2));  // after one step already
    EXPECT_NEAR(coarse.half_distance / fine.half_distance, 10, 0.1);
    EXPECT_LE(coarse.half_distance, coarse.half_width);
  }
}

TEST(NoiseFloor, TheShiftIsAddedInEveryStep) {
  const System& system = PointMassSystem();
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(2, 3);
  const Eigen::Vector4d still = Eigen::Vector4d::Zero(), shift(0.5, 0, 0, 0);
  EXPECT_NEAR(ShiftedRollout(system, still, controls, shift)(0, 3), 1.5, 1e-9);
  EXPECT_NEAR(ShiftedRollout(system, still, controls, -shift)(0, 3), -1.5, 1e-9);
}

}  // namespace forereach::research::witness_test
