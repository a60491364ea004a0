// Slope estimates by hand; no estimator finds a slope that no sample shows.
#include "identify/slopes.h"

#include "tests/test.h"

#include "forereach/residual/consistency.h"
#include "tests/research/methods/small_task.h"

namespace forereach::research::slopes_test {

constexpr SlopeEstimator kAll[] = {SlopeEstimator::kLacki, SlopeEstimator::kStrongin, SlopeEstimator::kKnuthChou};

double SlopeOf(SlopeEstimator estimator, const Task& task) {
  return EstimateSlopes(estimator, task.declaration, Observe(*task.model, task.data), 1)[2];
}

TEST(Slopes, OfALineAreFactorsOfItsDeclaration) {
  Task task = HandTask(0, 0.5);
  for (int i = -3; i <= 4; ++i) ObserveAt(task, 0, i, 0.25 * i);
  EXPECT_NEAR(SlopeOf(SlopeEstimator::kLacki, task), 0.5, 1e-12);
  EXPECT_NEAR(SlopeOf(SlopeEstimator::kStrongin, task), 0.75, 1e-12);
  EXPECT_NEAR(SlopeOf(SlopeEstimator::kKnuthChou, task), 0.5, 1e-12);  // all slopes are one
}

TEST(Slopes, LackiTakesTwiceTheNoiseOff) {
  Task task = HandTask(0, 1);
  ObserveAt(task, 0, 0, 0);
  ObserveAt(task, 0, 2, 1);
  task.declaration.noise_bound[2] = 0.125;
  EXPECT_NEAR(SlopeOf(SlopeEstimator::kLacki, task), 0.375, 1e-12);
  task.declaration.noise_bound[2] = 1;
  EXPECT_EQ(SlopeOf(SlopeEstimator::kLacki, task), 0);
}

TEST(Slopes, WeighCoordinatesAsTheDeclarationDoes) {
  Task task = HandTask(0.5, 1);
  ObserveAt(task, 0, 0, 0);
  ObserveAt(task, 4, 1, 1.5);  // distance 0.5 * 4 + 1
  EXPECT_NEAR(SlopeOf(SlopeEstimator::kLacki, task), 0.5, 1e-12);
}

TEST(Slopes, IgnorePairsAtOnePlaceAndRowsWithoutColumns) {
  Task task = HandTask(0, 1);
  ObserveAt(task, 0, 1, 0);
  ObserveAt(task, 3, 1, 1);
  for (const SlopeEstimator estimator : kAll)
    EXPECT_THAT(EstimateSlopes(estimator, task.declaration, Observe(*task.model, task.data), 1), Each(0));
}

// A residual that is zero wherever it was sampled and rises beyond: the paper's three estimates are 0.000.
TEST(Slopes, AreZeroForAResidualThatIsFlatAtItsSamples) {
  Task task = HandTask(0.25, 1);
  Random random(9);
  for (int i = 0; i < 100; ++i) ObserveAt(task, random.Uniform(-8, 8), random.Uniform(-4, 1), 0);
  for (const SlopeEstimator estimator : kAll) EXPECT_LT(SlopeOf(estimator, task), 1e-11);
}

TEST(Slopes, EstimatedDeclarationsOfLackiPassThePairwiseTest) {
  const Task task = BicycleTask(100, 1);
  const Observations observations = Observe(*task.model, task.data);
  const Declaration estimated = EstimatedDeclaration(SlopeEstimator::kLacki, task.declaration, observations, 1);
  EXPECT_FALSE(FindViolation(estimated, observations).has_value());
  EXPECT_LT(estimated.lipschitz(2, 3), task.declaration.lipschitz(2, 3));
  Declaration less = estimated;
  less.lipschitz *= 0.99;
  EXPECT_TRUE(FindViolation(less, observations).has_value());
}

TEST(Slopes, KnuthChouDependsOnTheSeedAlone) {
  const Task task = BicycleTask(100, 1);
  const Observations observations = Observe(*task.model, task.data);
  const auto estimate = [&](std::uint64_t seed) {
    return EstimateSlopes(SlopeEstimator::kKnuthChou, task.declaration, observations, seed)[2];
  };
  EXPECT_EQ(estimate(3), estimate(3));
  EXPECT_NE(estimate(3), estimate(4));
  EXPECT_GT(estimate(3), 0.5 * SlopeOf(SlopeEstimator::kLacki, task));
}

TEST(ExtremeValueEnd, OfMaximaOfUniformNumbersIsOne) {
  TracedRandom random(13);
  std::vector<double> maxima(2000, 0.0);
  for (double& largest : maxima)
    for (int i = 0; i < 20; ++i) largest = std::max(largest, random.Uniform(0, 1));
  EXPECT_NEAR(ExtremeValueEnd(maxima), 1, 0.01);
}

TEST(ExtremeValueEnd, IsNeverBelowTheLargest) {
  EXPECT_EQ(ExtremeValueEnd({2, 2, 2}), 2);
  EXPECT_GE(ExtremeValueEnd({1, 1, 1, 1, 9}), 9);
  EXPECT_GE(ExtremeValueEnd({1, 2, 3}), 3);
}

}  // namespace forereach::research::slopes_test
