// The paper's fixed grids give the paper's digits: rounded to nearest for the point mass, upward for the bicycle.
#include "experiments/paper_grids.h"

#include <cmath>

#include <gtest/gtest.h>

namespace forereach::experiments {
namespace {

double Rounded(double x) { return std::round(x * 1e9) / 1e9; }
double RoundedUp(double x) { return std::ceil(x * 1e9) / 1e9; }

TEST(PaperGrids, PointMassMeetsThePapersDigits) {
  const PointMassGrid grid = PaperPointMassGrid(VelocityKnee{0.15});
  EXPECT_DOUBLE_EQ(Rounded(grid.position_diagonal), 0.004609514);
  EXPECT_DOUBLE_EQ(Rounded(grid.position_cross), 0.003793347);
  EXPECT_DOUBLE_EQ(Rounded(grid.velocity_diagonal), 0.061460184);
  EXPECT_DOUBLE_EQ(Rounded(grid.velocity_cross), 0.050577964);
}

TEST(PaperGrids, BicycleMeetsThePapersDigits) {
  const BicycleGrid grid = PaperBicycleGrid(HeadingSaturation{0.1, 2.5});
  EXPECT_DOUBLE_EQ(RoundedUp(grid.by_speed), 0.011965171);
  EXPECT_DOUBLE_EQ(RoundedUp(grid.by_steering), 0.407688551);
}

TEST(PaperGrids, AFinerGridIsLower) {
  const VelocityKnee knee{0.15};
  EXPECT_LT(PaperPointMassGrid(knee, 5.4, 40000).velocity_diagonal, PaperPointMassGrid(knee).velocity_diagonal);
  EXPECT_GT(PaperPointMassGrid(knee, 5.4, 40000).velocity_diagonal, 0.06145786);
}

}  // namespace
}  // namespace forereach::experiments
