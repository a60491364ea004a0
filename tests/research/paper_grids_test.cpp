// The paper's fixed grids give the paper's digits, rounded upward, as it says; three it has rounded to nearest.
#include "research/paper_grids.h"

#include "tests/test.h"

#include "tests/oracle/traced_random.h"

namespace forereach::research::paper_grids_test {

double Rounded(double x) { return std::round(x * 1e9) / 1e9; }
double RoundedUp(double x) { return std::ceil(x * 1e9) / 1e9; }

TEST(PaperGrids, PointMassMeetsThePapersDigitsButForItsSlip) {
  const PointMassGrid grid = PaperPointMassGrid(VelocityKnee{0.15});
  EXPECT_DOUBLE_EQ(RoundedUp(grid.position_diagonal), 0.004609514);
  EXPECT_DOUBLE_EQ(RoundedUp(grid.position_cross), 0.003793348);
  EXPECT_DOUBLE_EQ(Rounded(grid.position_cross), 0.003793347);
  EXPECT_DOUBLE_EQ(RoundedUp(grid.velocity_diagonal), 0.061460185);
  EXPECT_DOUBLE_EQ(Rounded(grid.velocity_diagonal), 0.061460184);
  EXPECT_DOUBLE_EQ(RoundedUp(grid.velocity_cross), 0.050577965);
  EXPECT_DOUBLE_EQ(Rounded(grid.velocity_cross), 0.050577964);
}

TEST(PaperGrids, BicycleMeetsThePapersDigits) {
  const BicycleGrid grid = PaperBicycleGrid(HeadingSaturation{0.1, 2.5});
  EXPECT_DOUBLE_EQ(RoundedUp(grid.by_speed), 0.011965171);
  EXPECT_DOUBLE_EQ(RoundedUp(grid.by_steering), 0.407688551);
}

// The box of parameters whose slack ratios are the paper's: wheelbase, understeer, friction, gate temperature.
HeadingSaturation Scaled(double by) { return {0.1, 2.5 * by, 0.32 * by, 0.9 * by, 9.81, 0.1 * by}; }

TEST(PaperGrids, BoxesHaveThePapersSlack) {
  const auto norm = [](double part) {
    const BicycleGrid grid = PaperBicycleGrid(Scaled(1 - part), Scaled(1 + part));
    return std::hypot(grid.by_speed, grid.by_steering);
  };
  const double nominal = norm(0);
  EXPECT_NEAR(norm(0.05) / nominal, 1.177, 5e-4);
  EXPECT_NEAR(norm(0.1) / nominal, 1.606, 5e-4);
  EXPECT_NEAR(norm(0.2) / nominal, 2.838, 5e-4);
}

TEST(PaperGrids, ABoxBoundsTheSlopesOfAllItsParameters) {
  const HeadingSaturation low = Scaled(0.8), high = Scaled(1.2);
  const BicycleGrid bound = PaperBicycleGrid(low, high, 25, 0.48, 500, 250);
  double steepest = 0;
  for (TracedRandom random(5); random.Again(200'000);) {
    const auto between = [&](double a, double b) { return random.Uniform(a, b); };
    const HeadingSaturation residual{0.1,
                                     between(low.wheelbase, high.wheelbase),
                                     between(low.understeer, high.understeer),
                                     between(low.friction, high.friction),
                                     9.81,
                                     between(low.gate_temperature, high.gate_temperature)};
    std::array<double, 8> z{};
    z[3] = between(0, 25), z[5] = between(0, 0.48);
    const auto heading = [&](std::size_t moved, double by) {
      std::array<double, 8> at = z;
      at[moved] += by;
      std::array<double, 6> values{};
      residual(std::span<const double>(at), std::span<double>(values));
      return values[2];
    };
    constexpr double kStep = 1e-6;
    const double by_speed = std::abs(heading(3, kStep) - heading(3, -kStep)) / (2 * kStep),
                 by_steering = std::abs(heading(5, kStep) - heading(5, -kStep)) / (2 * kStep);
    ASSERT_LE(by_speed, bound.by_speed * (1 + 1e-6));
    ASSERT_LE(by_steering, bound.by_steering * (1 + 1e-6));
    steepest = std::max(steepest, by_steering);
  }
  EXPECT_GT(steepest, 0.4 * bound.by_steering);
}

TEST(PaperGrids, AFinerGridIsLower) {
  const VelocityKnee knee{0.15};
  EXPECT_LT(PaperPointMassGrid(knee, 5.4, 40000).velocity_diagonal, PaperPointMassGrid(knee).velocity_diagonal);
  EXPECT_GT(PaperPointMassGrid(knee, 5.4, 40000).velocity_diagonal, 0.06145786);
}

}  // namespace forereach::research::paper_grids_test
