// The calibrated methods against values worked by hand.
#include "research/methods/calibration.h"

#include "tests/test.h"

#include "research/methods/envelope.h"
#include "research/methods/plug_in_gaussian.h"
#include "tests/research/methods/small_task.h"

namespace forereach::research::calibration_test {

constexpr double kRounding = 1e-14;  // what a recorded successor of size 4 hides, and some

TEST(ConformalQuantile, IsTheRankOfTheFiniteSampleCorrection) {
  EXPECT_EQ(ConformalQuantile({3, 1, 9, 7, 2, 8, 4, 6, 5}, 0.1), 9);  // ceil(10 * 0.9) = 9 of 9
  EXPECT_EQ(ConformalQuantile({3, 1, 2, 4}, 0.5), 3);                 // ceil(5 * 0.5) = 3 of 4
  std::vector<double> scores;
  for (int i = 1; i <= 399; ++i) scores.push_back(i);
  EXPECT_EQ(ConformalQuantile(scores, 0.1), 360);
}

TEST(ConformalQuantile, IsInfiniteWithTooFewScores) {
  EXPECT_EQ(ConformalQuantile({1, 2, 3, 4, 5, 6, 7, 8}, 0.1), kInfinity);
  EXPECT_EQ(ConformalQuantile({}, 0.1), kInfinity);
}

TEST(ConformalQuantile, RefusesALevelOutsideTheUnitInterval) {
  EXPECT_THROW((void)ConformalQuantile({1}, 0), std::invalid_argument);
  EXPECT_THROW((void)ConformalQuantile({1}, 1), std::invalid_argument);
  EXPECT_THROW((void)ConformalQuantile({1}, std::nan("")), std::invalid_argument);
}

TEST(GlobalCalibration, IsMeanAndQuantileWhereverItIsAsked) {
  Task task = HandTask(0, 0.5);  // 2 outliers of 30 lie beyond the 28th
  ObserveAt(task, 0, 0, 10);
  ObserveAt(task, 0, 0, -10);
  for (int i = 0; i < 14; ++i) {
    ObserveAt(task, 0, 1, 1);
    ObserveAt(task, 0, -1, -1);
  }
  const auto enclosure = MakeGlobalCalibration(task.setting());
  for (const double vx : {-3.0, 0.0, 2.5}) {
    const ResidualBounds bounds = HandQuery(0, vx).Of(*enclosure);
    EXPECT_NEAR(bounds.lower[2], -1, kRounding);
    EXPECT_NEAR(bounds.upper[2], 1, kRounding);
    EXPECT_LE(bounds.lower[0], 0);
    EXPECT_GE(bounds.upper[0], 0);
    EXPECT_LT(bounds.upper[0], kRounding);
  }
}

TEST(GlobalCalibration, HasNoFiniteBoundFromEightObservations) {
  Task task = HandTask(0, 0.5);
  for (int i = 0; i < 8; ++i) ObserveAt(task, 0, 0, i);
  EXPECT_EQ(HandQuery(0, 0).Of(*MakeGlobalCalibration(task.setting())).upper[2], kInfinity);
}

// Ten observations at vx in [2, 4] around 3 +- 0.5, ten at vx in [0, 2] around 1 +- 0.5; none at vx < 0.
Task TwoRegions() {
  Task task = HandTask(0, 1);
  for (int i = 0; i < 10; ++i) {
    ObserveAt(task, 0, 3, i % 2 ? 2.5 : 3.5);
    ObserveAt(task, 0, 1, i % 2 ? 0.5 : 1.5);
  }
  return task;
}

TEST(RegionalCalibration, HasABoxForEachCell) {
  const Task task = TwoRegions();
  const RegionalCalibration enclosure(task.setting(), {});
  EXPECT_EQ(enclosure.num_calibrated(), 2);
  const ResidualBounds high = HandQuery(0, 3, 0, 0.5).Of(enclosure), low = HandQuery(0, 1, 0, 0.5).Of(enclosure);
  EXPECT_NEAR(high.lower[2], 2.5, kRounding);
  EXPECT_NEAR(high.upper[2], 3.5, kRounding);
  EXPECT_NEAR(low.lower[2], 0.5, kRounding);
  EXPECT_NEAR(low.upper[2], 1.5, kRounding);
}

TEST(RegionalCalibration, TakesTheHullOfTheCellsThatAQueryMeets) {
  const Task task = TwoRegions();
  const RegionalCalibration enclosure(task.setting(), {});
  const ResidualBounds both = HandQuery(0, 2, 0, 0.5).Of(enclosure);
  EXPECT_NEAR(both.lower[2], 0.5, kRounding);
  EXPECT_NEAR(both.upper[2], 3.5, kRounding);
}

TEST(RegionalCalibration, FallsBackToTheGlobalBoxWhereDataAreMissing) {
  const Task task = TwoRegions();
  const RegionalCalibration enclosure(task.setting(), {});
  const ResidualBounds there = HandQuery(0, -3).Of(enclosure),
                       global = HandQuery(0, -3).Of(*MakeGlobalCalibration(task.setting()));
  EXPECT_FIELDS(there, (lower[2], global.lower[2]), (upper[2], global.upper[2]));
}

TEST(RegionalCalibration, EqualsTheGlobalOneWhileNoCellHasNineObservations) {
  Task task = HandTask(0, 1);
  for (int i = 0; i < 8; ++i) {
    ObserveAt(task, 0, 3, i);
    ObserveAt(task, 0, 1, -i);
  }
  const RegionalCalibration enclosure(task.setting(), {});
  EXPECT_EQ(enclosure.num_calibrated(), 0);
  EXPECT_EQ(HandQuery(0, 3).Of(enclosure).upper[2],
            HandQuery(0, 3).Of(*MakeGlobalCalibration(task.setting())).upper[2]);
}

TEST(RegionalCalibration, IsNoNarrowerOnALargerQuery) {
  TracedRandom random(11);
  const Task task = BicycleTask(400, 5);
  for (const Elsewhere elsewhere :
       {Elsewhere::kGlobal, Elsewhere::kNearest, Elsewhere::kWidest, Elsewhere::kDeclared, Elsewhere::kUnbounded}) {
    const RegionalCalibration enclosure(task.setting(), {.elsewhere = elsewhere});
    EXPECT_GT(enclosure.num_calibrated(), 2);
    for (int trial = 0; trial < 100; ++trial) {
      const Query small = AnyQueryIn(random, task, 0.2);
      const Eigen::VectorXd center = small.set().slice.CenterVector();
      const Query large(Zonotope(center, 1.5 * small.set().slice.GeneratorMatrix()), {0, 0});
      const ResidualBounds inner = small.Of(enclosure), outer = large.Of(enclosure);
      ASSERT_LE(outer.lower[2], inner.lower[2]);
      ASSERT_GE(outer.upper[2], inner.upper[2]);
    }
  }
}

// Cells of vx: [-4, -2], [-2, 0], [0, 2] with r in [0.5, 1.5], [2, 4] with r in [2.5, 3.5].
TEST(RegionalCalibration, BoundsAQueryElsewhereByItsRule) {
  const Task task = TwoRegions();
  const auto at = [&](double vx, Elsewhere elsewhere) {
    return HandQuery(0, vx).Of(RegionalCalibration(task.setting(), {.elsewhere = elsewhere}));
  };
  const ResidualBounds nearest = at(-1, Elsewhere::kNearest), widest = at(-1, Elsewhere::kWidest),
                       unbounded = at(-1, Elsewhere::kUnbounded), declared = at(-1, Elsewhere::kDeclared);
  EXPECT_NEAR(nearest.lower[2], 0.5, kRounding);
  EXPECT_NEAR(nearest.upper[2], 1.5, kRounding);
  EXPECT_NEAR(widest.lower[2], 0.5, kRounding);
  EXPECT_NEAR(widest.upper[2], 3.5, kRounding);
  EXPECT_EQ(unbounded.upper[2], kInfinity);
  EXPECT_LT(unbounded.upper[0], kInfinity);
  EXPECT_EQ(declared.upper[2], HandQuery(0, -1).Of(*MakeForeReach(task.setting())).upper[2]);
  // With data in its cell, no rule says anything.
  EXPECT_EQ(at(3, Elsewhere::kUnbounded).upper[2], at(3, Elsewhere::kNearest).upper[2]);
}

TEST(RegionalCalibration, SharesTheLevelOutAmongItsCells) {
  Task task = TwoRegions();  // ten each: enough for 0.10, of 0.05 nineteen are wanted
  const CalibrationOptions level{0.10, Center::kZero};
  EXPECT_EQ(RegionalCalibration(task.setting(), {.regional = level}).num_calibrated(), 2);
  EXPECT_EQ(RegionalCalibration(task.setting(), {.regional = level, .jointly = true}).num_calibrated(), 0);
  for (int i = 0; i < 9; ++i) ObserveAt(task, 0, 3, 3);
  EXPECT_EQ(RegionalCalibration(task.setting(), {.regional = level, .jointly = true}).num_calibrated(), 1);
}

// What the paper says of its regional calibration, and what the one of the comparison was chosen for.
TEST(RegionalCalibration, OfTheComparisonIsGlobalWithFewDataAndWiderThanItElsewhereWithMany) {
  const Task few = BicycleTask(25, 5), many = BicycleTask(400, 5);
  Eigen::VectorXd center(6), half_width = Eigen::VectorXd::Constant(6, 0.01);
  center << 0, 0, 0, 12, 0, -0.3;
  const Query mirrored(Zonotope::FromBox(center, half_width), {0, 0});
  const ResidualBounds sparse = mirrored.Of(*MakeRegionalCalibration(few.setting())),
                       global = mirrored.Of(*MakeGlobalCalibration(few.setting()));
  EXPECT_FIELDS(sparse, (lower[2], global.lower[2]), (upper[2], global.upper[2]));
  const ResidualBounds dense = mirrored.Of(*MakeRegionalCalibration(many.setting())),
                       narrow = mirrored.Of(*MakeGlobalCalibration(many.setting()));
  EXPECT_LT(dense.lower[2], narrow.lower[2]);
  EXPECT_GT(dense.upper[2], 0.02);  // the mirrored plans turn the other way
  EXPECT_LT(narrow.upper[2], 0.02);
}

TEST(Calibration, AroundZeroIsAsWideOnBothSides) {
  Task task = HandTask(0, 0.5);
  for (int i = 0; i < 10; ++i) ObserveAt(task, 0, 0, 2 + i % 2);
  const auto enclosure = MakeGlobalCalibration(task.setting(), {0.10, Center::kZero});
  EXPECT_NEAR(HandQuery(0, 0).Of(*enclosure).lower[2], -3, kRounding);
  EXPECT_NEAR(HandQuery(0, 0).Of(*enclosure).upper[2], 3, kRounding);
}

TEST(PlugInGaussian, IsMeanAndScaledDeviation) {
  Task task = HandTask(0, 0.5);
  for (const double r : {1.0, 2.0, 3.0}) ObserveAt(task, 0, 0, r);  // mean 2, s = 1
  const ResidualBounds bounds = HandQuery(0, -2).Of(*MakePlugInGaussian(task.setting()));
  EXPECT_NEAR(bounds.lower[2], 1, kRounding);
  EXPECT_NEAR(bounds.upper[2], 3, kRounding);
  const ResidualBounds twice = HandQuery(0, -2).Of(*MakePlugInGaussian(task.setting(), 2, Center::kZero));
  EXPECT_NEAR(twice.upper[2], 2 * std::sqrt(7), kRounding);  // (1 + 4 + 9) / 2
  EXPECT_NEAR(twice.lower[2], -2 * std::sqrt(7), kRounding);
}

TEST(PlugInGaussian, OfOneObservationIsThatOne) {
  Task task = HandTask(0, 0.5);
  ObserveAt(task, 0, 0, 0.25);
  const ResidualBounds bounds = HandQuery(0, 0).Of(*MakePlugInGaussian(task.setting()));
  EXPECT_NEAR(bounds.lower[2], 0.25, kRounding);
  EXPECT_NEAR(bounds.upper[2], 0.25, kRounding);
}

}  // namespace forereach::research::calibration_test
