// CommonRoad's single-track drift model, and the experiment on it.
#include "research/drift/drift.h"

#include "tests/test.h"

#include "research/drift/drive.h"

namespace forereach::research::drift_test {

TEST(SingleTrackDrift, HasThePublishedDerivative) {
  // State, input and derivative from the unit test of CommonRoad's program (test_derivatives, test_std), with
  // vehicle 2.
  DriftState state, published;
  state << 2.0233348142065677, 0.0041907137716636, 0.0197545248559617, 15.7216236334290116, 0.0025857914776859,
      0.0529001056654038, 0.0033012170610298, 53.6551710641082451, 56.7917911784219598;
  published << 15.72135120308624, 0.09255279797193551, 0.15, 11.340113304616798, 0.0529001056654038, 0.466681022626497,
      -0.02037000180254231, -1072.4665253469798, -253.94486828306555;
  const DriftState rate = DriftRate(state, {0.15, 0.63 * 9.81});
  for (int k = 0; k < 9; ++k) EXPECT_NEAR(rate[k], published[k], 1e-12 * std::max(1.0, std::abs(published[k]))) << k;
}

TEST(SingleTrackDrift, KeepsItsSpeedStraightAhead) {
  // The tyres' shifts, with which a rolling wheel has a small force, die out within some milliseconds.
  const DriftState settled = Drift(Rolling(15), {0, 0}, 1, 2000), later = Drift(settled, {0, 0}, 4, 8000);
  EXPECT_NEAR(settled[kSpeed], 15, 1e-3);
  EXPECT_NEAR(later[kSpeed], settled[kSpeed], 1e-6);
  EXPECT_NEAR(later[kDriftX] - settled[kDriftX], 60, 4e-3);
  EXPECT_LT(std::abs(later[kBeta]), 1e-3);
}

TEST(SingleTrackDrift, IsKinematicWhereItIsSlow) {
  // At 0.01 m/s the dynamic model's weight is (tanh(-3.8) + 1) / 2 = 5e-4.
  const double delta = 0.2, v = 0.01, a = 0.1, rear = 4.667707 * 0.3048, base = (3.793293 + 4.667707) * 0.3048;
  const DriftState rate = DriftRate(Rolling(v, delta), {0, a});
  const double weight = (std::tanh(-3.8) + 1) / 2, slip = std::atan(std::tan(delta) * rear / base);
  EXPECT_NEAR(rate[kPsi], (1 - weight) * v * std::cos(slip) * std::tan(delta) / base, 1e-15);
  EXPECT_NEAR(rate[kSpeed], a, 0.01);
  EXPECT_NEAR(rate[kBeta], 0, 1e-12);  // it is a multiple of the rate of steering
  EXPECT_NEAR(DriftRate(Rolling(v, delta), {9, a})[kDelta], 0.4, 0);
}

TEST(SingleTrackDrift, AHalvedStepChangesNothing) {
  DriftState coarse = Rolling(8), fine = coarse;
  for (const DriftInput& input : {DriftInput(0.4, 2.5), DriftInput(0.4, -4), DriftInput(-0.4, 2.5)}) {
    coarse = Drift(coarse, input, 0.1, 200);
    fine = Drift(fine, input, 0.1, 400);
  }
  EXPECT_LT((coarse - fine).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(DriftExperiment, OrdinaryDrivingIsNearTheSingleTrackModelAndTheLimitIsNot) {
  const auto largest = [](double lateral) {
    const Problem problem = SingleTrackProblem(0.05);
    Eigen::RowVectorXd most = Eigen::RowVectorXd::Zero(7);
    for (const Drive& drive : RandomDrives({.most_lateral = lateral, .drives = 2, .seconds = 10, .seed = 5}))
      most = most.cwiseMax(ErrorsOf(*problem.model, drive.transitions).cwiseAbs().colwise().maxCoeff());
    return most;
  };
  const Eigen::RowVectorXd ordinary = largest(3), limit = largest(9);
  EXPECT_LT(ordinary[kDelta], 1e-14);
  EXPECT_LT(ordinary[kSpeed], 0.03);
  EXPECT_LT(ordinary[kBeta], 0.002);
  EXPECT_GT(limit[kBeta], 3 * ordinary[kBeta]);
  EXPECT_GT(limit[kOmega], 3 * ordinary[kOmega]);
}

TEST(DriftExperiment, TheSmallFormWritesItsTables) {
  const ScratchDirectory scratch;
  std::ostringstream out;
  RunDrift({scratch.path(), true, "research/run drift --quick"}, out);
  for (const char* title : {"## One-step errors", "## Slopes", "## Declarations on fresh drives",
                            "## Up to the limit of the tyres", "## Against dt"})
    EXPECT_THAT(out.str(), HasSubstr(title));
  EXPECT_THAT(out.str(), HasSubstr("| largest | 0 | 10 |"));
}

TEST(DriftCar, KeepsTheSpeedsOfItsWheels) {
  DriftCar car(0.05);
  Eigen::VectorXd measured = Rolling(12).head(7);
  DriftState whole = Rolling(12);
  for (const DriftInput& input : {DriftInput(0.3, 2), DriftInput(-0.1, -4), DriftInput(0, -4)}) {
    const std::vector<double> x(measured.begin(), measured.end());
    car.Step(x, {input.data(), 2}, {measured.data(), 7});
    whole = Drift(whole, input, 0.05, 100);
    EXPECT_LT((measured - whole.head(7)).cwiseAbs().maxCoeff(), 1e-12);
  }
  EXPECT_GT(car.most().acceleration[0], 3);
  EXPECT_LT(car.most().acceleration[0], 5);
  EXPECT_GT(car.most().turn_rate, 0.01);
}

TEST(DriftDrive, ReachesItsGoalInsideItsSlices) {
  const ScratchDirectory scratch;
  SilenceLog();
  const std::string task = WriteDriveTask(scratch.path(), 1.5);
  for (const int seed : {1, 2}) {
    SCOPED_TRACE(seed);
    const DriftDrives driven = DriveOnDrift(task, seed);
    EXPECT_TRUE(driven.counts.good());
    EXPECT_EQ(driven.counts.stops, 0);
    EXPECT_GT(driven.counts.steps, 300);
    EXPECT_GT(driven.counts.certified, 20);
    EXPECT_FIELDS(driven, (faulted, 0), (beyond_between, 0));
  }
}

}  // namespace forereach::research::drift_test
