// The certificate budget by hand, the starvation floor to the digit, and on the bicycle every budget starved or
// vacuous.
#include "research/methods/cp_sls.h"

#include "tests/test.h"

#include "tests/research/methods/small_task.h"

namespace forereach::research::cp_sls_test {

constexpr Covariance kAll[] = {Covariance::kLocal, Covariance::kLocalDiagonal, Covariance::kGlobal,
                               Covariance::kGlobalDiagonal};

CpSlsOptions With(Covariance covariance) { return {.covariance = covariance, .miscoverage = 0.1, .horizon = 12}; }

TEST(CpSls, StarvationFloorIsThePapers) { EXPECT_EQ(StarvationFloor(0.10, 12), 119.0); }

Task AtTheOrigin(int count) {
  Task task = HandTask(0, 1);
  for (int i = 0; i < count; ++i) ObserveAt(task, 0, 0, i % 2 ? 1 : -1);
  return task;
}

TEST(CpSls, RadiusIsFiniteFromTheFloorOn) {
  const Task starved = AtTheOrigin(118), fed = AtTheOrigin(119);
  const Query query = HandQuery(0, 0);
  for (const Covariance covariance : kAll) {
    const CpSls below(starved.setting(), With(covariance)), at(fed.setting(), With(covariance));
    EXPECT_FIELDS(query.Of(below), (upper[2], kInfinity), (lower[0], -kInfinity));
    EXPECT_TRUE(below.Budget(query.set()).IsVacuous());
    EXPECT_EQ(below.Budget(query.set()).total(), kInfinity);
    EXPECT_EQ(at.Mass(Eigen::VectorXd::Zero(6)), 119);
    EXPECT_NEAR(query.Of(at).upper[2], 1, 1e-6);
  }
}

TEST(CpSls, UpToOneHundredObservationsAreStarvedEverywhere) {
  const Task task = BicycleTask(100, 4);
  const CpSls method(task.setting(), {});
  for (TracedRandom random(2); random.Again(100);)
    ASSERT_EQ(AnyQueryIn(random, task, 0.1).Of(method).upper[2], kInfinity);
}

// 150 observations +-1 at the origin, 50 of +-3 at vx = 4, one half-width of the domain away: weight exp(-1/12).
Task TwoPlaces() {
  Task task = AtTheOrigin(150);
  for (int i = 0; i < 50; ++i) ObserveAt(task, 0, 4, i % 2 ? 3 : -3);
  return task;
}

TEST(CpSls, EllipsoidByHand) {
  const Task task = TwoPlaces();
  const double far = std::exp(-1.0 / 12);
  const CpSls global(task.setting(), With(Covariance::kGlobalDiagonal));
  EXPECT_NEAR(global.Mass(Eigen::VectorXd::Zero(6)), 150 + 50 * far, 1e-12);
  // Variance (150 + 450) / 200; the level wants more weight than the origin's 150, so the score is that of a 3.
  EXPECT_NEAR(global.Radius(Eigen::VectorXd::Zero(6)), std::sqrt(3), 1e-6);
  EXPECT_NEAR(HandQuery(0, 0).Of(global).upper[2], 3, 1e-6);
  // A local ellipsoid at the origin is scaled by the variance there; scores by those at their own places.
  const CpSls local(task.setting(), With(Covariance::kLocalDiagonal));
  const double here = (150 + 450 * far) / (150 + 50 * far), there = (150 * far + 450) / (150 * far + 50);
  EXPECT_NEAR(local.Radius(Eigen::VectorXd::Zero(6)), 3 / std::sqrt(there), 1e-6);
  EXPECT_NEAR(HandQuery(0, 0).Of(local).upper[2], 3 * std::sqrt(here / there), 1e-6);
}

TEST(CpSls, OneLargeScoreInTwoHundredFortyOneIsLeftOut) {
  Task task = AtTheOrigin(240);
  ObserveAt(task, 0, 0, 3);
  EXPECT_NEAR(HandQuery(0, 0).Of(CpSls(task.setting(), With(Covariance::kGlobal))).upper[2], 1, 1e-6);
  task.data.z.conservativeResize(200, Eigen::NoChange);  // of 200 of them even the largest is wanted
  task.data.x_next.conservativeResize(200, Eigen::NoChange);
  task.data.x_next(199, 2) = 3;
  EXPECT_NEAR(HandQuery(0, 0).Of(CpSls(task.setting(), With(Covariance::kGlobal))).upper[2], 3, 1e-6);
}

TEST(CpSls, BudgetByHand) {
  const Task task = TwoPlaces();
  const CpSls method(task.setting(), With(Covariance::kGlobal));
  // Halves of the data: all ones against half ones, half threes; their means are 1/2 apart.
  EXPECT_NEAR(method.drift_rate(), 0.5 / 0.5, 1e-12);
  const Query query = HandQuery(0, 0, 0, 0.4);
  const double far = std::exp(-1.0 / 12);
  const CpSlsBudget budget = method.Budget(query.set());
  EXPECT_DOUBLE_EQ(budget.alpha, 0.1 / 12);
  EXPECT_NEAR(budget.drift, 2 * 50 * far / (151 + 50 * far), 1e-12);
  EXPECT_NEAR(budget.tube, 2 * 2 * 0.4 / 4, 1e-12);
  EXPECT_FALSE(budget.starved);
  CpSlsBudget sum;
  for (int t = 0; t < 12; ++t) sum += budget;
  EXPECT_NEAR(sum.alpha, 0.1, 1e-15);
  EXPECT_TRUE(sum.IsVacuous());
}

TEST(CpSls, TheCapHidesTheRateAndActiveCoordinatesCountAlone) {
  const Task task = TwoPlaces();
  const Query query = HandQuery(0, 0, 0, 0.4);
  const CpSls all(task.setting(), With(Covariance::kGlobal));
  CpSlsOptions options = With(Covariance::kGlobal);
  // The far ones are one half-width away, and eps^ is 1.
  const double far = std::exp(-1.0 / 12);
  EXPECT_NEAR(all.Budget(query.set()).at_cap, 50 * far / (150 + 50 * far), 1e-12);
  options.active_only = true;  // vx alone: a mean square over one coordinate
  const CpSls active(task.setting(), options);
  EXPECT_NEAR(active.Mass(Eigen::VectorXd::Zero(6)), 150 + 50 * std::exp(-0.5), 1e-12);
  // A position of the plan is no distance.
  EXPECT_EQ(active.Budget(HandQuery(3, 0).set()).drift, active.Budget(HandQuery(0, 0).set()).drift);
  EXPECT_NE(all.Budget(HandQuery(3, 0).set()).drift, all.Budget(HandQuery(0, 0).set()).drift);
}

TEST(CpSls, TheLeastRateIsNoLarger) {
  const Task task = BicycleTask(200, 6);
  CpSlsOptions options = With(Covariance::kLocal);
  const double largest = CpSls(task.setting(), options).drift_rate();
  options.least_rate = true;
  const double least = CpSls(task.setting(), options).drift_rate();
  EXPECT_GT(least, 0);
  EXPECT_LT(least, largest);
}

TEST(CpSls, BudgetWithoutDriftIsTheMiscoverage) {
  const CpSls method(AtTheOrigin(200).setting(), {});
  EXPECT_EQ(method.drift_rate(), 0);
  CpSlsBudget sum;
  for (int t = 0; t < 12; ++t) sum += method.Budget(HandQuery(0, 1, 0, 0.5).set());
  EXPECT_NEAR(sum.total(), 0.1, 1e-15);
  EXPECT_FALSE(sum.IsVacuous());
}

// Algorithm of the paper's figure: 12 steps of a plan in the corridor.
TEST(CpSls, EveryPlugInIsStarvedOrVacuousOnTheCorridor) {
  for (const int count : {25, 50, 100, 150, 200, 400})
    for (const Covariance covariance : kAll) {
      const Task task = BicycleTask(count, 6);
      const CpSls method(task.setting(), With(covariance));
      const Propagator propagator(*task.model, task.domain, method, {}, 5, forereach::Method::kPaper);
      Eigen::VectorXd center(6), half_width(6);
      center << 0, 0, 0, 12, 0, 0.32;
      half_width << 0.025, 0.025, 0.005, 0.025, 0.01, 0.002;
      Zonotope slice = Zonotope::FromBox(center, half_width), next;
      const std::array input{0.2, 0.02};
      StepRecord record;
      std::array<double, kMaxStates> next_half_width;
      Propagator::HalfWidths(slice, record.half_width.data());
      CpSlsBudget budget;
      for (int t = 0; t < 12; ++t) {
        budget += method.Budget({slice, input, {record.half_width.data(), 6}});
        if (propagator.Step(slice, input, record, next, next_half_width.data()).status != StepResult::Status::kDone)
          break;
        slice.Assign(next);
        record.half_width = next_half_width;
      }
      EXPECT_TRUE(budget.IsVacuous()) << count;
      EXPECT_GT(budget.starved ? 1 : budget.drift, 0) << count;
      if (count <= 100) EXPECT_TRUE(budget.starved) << count;
    }
}

TEST(CpSls, RefusesAnOptionOutOfRange) {
  const Task task = AtTheOrigin(1);
  EXPECT_THROW(CpSls(task.setting(), {Covariance::kLocal, 0, 12}), std::invalid_argument);
  EXPECT_THROW(CpSls(task.setting(), {Covariance::kLocal, 0.1, 0}), std::invalid_argument);
}

}  // namespace forereach::research::cp_sls_test
