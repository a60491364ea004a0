#include "task/motion.h"

#include "tests/test.h"

#include "tests/planner_bridge/tasks.h"

namespace forereach::motion_test {

Eigen::VectorXd Successor(const NominalModel& model, const Eigen::VectorXd& x, const Eigen::VectorXd& u) {
  Eigen::VectorXd z(x.size() + u.size()), next(x.size());
  z << x, u;
  model.Evaluate({z.data(), static_cast<std::size_t>(z.size())}, {next.data(), static_cast<std::size_t>(next.size())});
  return next;
}

std::span<const double> Span(const Eigen::VectorXd& x) { return {x.data(), static_cast<std::size_t>(x.size())}; }

// Brakes with every tail from random states; each ends at rest.
void ExpectStandstill(const Config& config, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                      std::uint32_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  const Problem& problem = *config.problem;
  const RobotMotion motion(config, Braking::kPlanned);
  std::mt19937 random(seed);
  for (int i = 0; i < 300; ++i) {
    Eigen::VectorXd x(lower.size());
    for (int k = 0; k < x.size(); ++k) x(k) = std::uniform_real_distribution(lower(k), upper(k))(random);
    for (int tail = 0; tail < motion.num_tails(); ++tail) {
      Eigen::MatrixXd controls;
      ASSERT_TRUE(motion.Brake(Span(x), tail, 100, controls)) << x.transpose();
      Eigen::VectorXd state = x;
      for (int t = 0; t < controls.cols(); ++t) {
        EXPECT_TRUE(problem.domain.input.Contains(controls.col(t)));
        state = Successor(*problem.model, state, controls.col(t));
      }
      for (const RestBound& bound : *config.laws.at_rest)
        EXPECT_LE(std::abs(state(bound.coordinate)), bound.tolerance) << x.transpose();
    }
  }
}

TEST(Motion, EveryTailOfTheBicycleEndsAtStandstill) {
  ExpectStandstill(Bicycle(), Vec({0, 0, 0, 0.5, -2, -0.48}), Vec({0, 0, 0, 11, 2.5, 0.48}), 1);
}

TEST(Motion, TheTailOfThePointMassEndsAtStandstill) {
  ExpectStandstill(PointMass(), Vec({0, 0, -3, -3}), Vec({0, 0, 3, 3}), 2);
}

TEST(Motion, ATailThatNeedsMoreStepsThanAllowedIsRefused) {
  const Config config = Bicycle();
  const RobotMotion motion(config, Braking::kPlanned);
  const Eigen::VectorXd x = Vec({0, 0, 0, 9, 0, 0});
  Eigen::MatrixXd controls;
  ASSERT_TRUE(motion.Brake(Span(x), 0, 100, controls));
  const int needed = static_cast<int>(controls.cols());
  EXPECT_GE(needed, 36);  // 9 m/s at 2.6 m/s^2, which it takes some steps to reach
  EXPECT_TRUE(motion.Brake(Span(x), 0, needed, controls));
  EXPECT_FALSE(motion.Brake(Span(x), 0, needed - 1, controls));
}

TEST(Motion, ARobotThatStandsNeedsNoTail) {
  const Config config = Bicycle();
  Eigen::MatrixXd controls;
  ASSERT_TRUE(RobotMotion(config, Braking::kPlanned).Brake(Span(Vec({1, 2, 3, 0, 0, 0})), 0, 0, controls));
  EXPECT_EQ(controls.cols(), 0);
}

// What acts has to lie in the domain, however far it is off a plan's control.
TEST(Motion, ControlsStayInTheDomainWithTheirErrors) {
  Config config = PointMass();
  const Box exact = RobotMotion(config, Braking::kPlanned).controls(), domain = config.problem->domain.input;
  EXPECT_EQ(exact.upper(), domain.upper());
  const double error = 0.6;
  Own(config.problem).declaration.input_error = Vec({error, 9});
  const RobotMotion motion(config, Braking::kPlanned);
  const Box& controls = motion.controls();
  EXPECT_LE(AddUp(controls.upper()[0], error), domain.upper()[0]);
  EXPECT_GE(SubDown(controls.lower()[0], error), domain.lower()[0]);
  EXPECT_GT(controls.upper()[0], domain.upper()[0] - 1.001 * error);
  EXPECT_FIELDS(controls, (lower()[1], 0), (upper()[1], 0));  // nothing is left
  Eigen::MatrixXd braking;
  ASSERT_TRUE(motion.Brake(Span(Vec({0, 0, 2.5, 0})), 0, 100, braking));
  EXPECT_EQ(braking.row(0).minCoeff(), controls.lower()[0]) << "it brakes as hard as it may";
}

TEST(Motion, HasTheStepOfItsModel) {
  EXPECT_DOUBLE_EQ(RobotMotion(Bicycle(), Braking::kPlanned).dt(), 0.1);
  EXPECT_DOUBLE_EQ(RobotMotion(PointMass(), Braking::kPlanned).dt(), 0.15);
}

TEST(Motion, PursuitTurnsTowardsTheHeadingWithinTheInputDomain) {
  const Config config = Bicycle();
  const RobotMotion motion(config, Braking::kPlanned);
  for (const double heading : {-2.0, -0.3, 0.4, 2.5}) {
    Eigen::VectorXd x = Vec({0, 0, 0, 5, 0, 0});
    for (int t = 0; t < 60; ++t) {
      Eigen::VectorXd u(2);
      motion.Pursue(Span(x), {heading, 6, 0}, {u.data(), 2});
      EXPECT_TRUE(config.problem->domain.input.Contains(u));
      x = Successor(*config.problem->model, x, u);
    }
    EXPECT_NEAR(x(2), heading, 0.05);
    EXPECT_NEAR(x(3), 6, 0.3);
  }
}

}  // namespace forereach::motion_test
