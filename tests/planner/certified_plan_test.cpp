#include "planner_bridge/certified_plan.h"

#include <gtest/gtest.h>

#include "tests/planner/tasks.h"

namespace forereach {
namespace {

Config WithInitialSet(Config config) {
  const Eigen::VectorXd center = Vec({0, 0, 0, 0}), half_width = Vec({0.05, 0.05, 0.03, 0.03});
  config.initial_set = Box(center - half_width, center + half_width);
  return config;
}

TEST(CertifiedPlan, TakesThePointMassToTheGoalInOnePlanThatEndsInAStop) {
  Config config = WithInitialSet(PointMass());
  config.planner.tail_steps = 20;
  const auto proposer = MakeProposer(config);
  const Certifier certifier(config.problem);
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const CertifiedPlan plan = FindCertifiedPlan(*proposer, certifier, config, seed);
    ASSERT_GT(plan.controls.cols(), 0);
    EXPECT_TRUE(plan.reaches_goal);
    EXPECT_LT(plan.progress_steps, plan.controls.cols());
    const Plan again{plan.controls.data(), 2, static_cast<int>(plan.controls.cols()), 2};
    Tube tube;
    const Decision decision = certifier.Certify(again, Zonotope::Enclose(config.initial_set), config.obstacles, tube);
    EXPECT_EQ(decision.outcome, Outcome::kCertified);
    EXPECT_EQ(decision.margin, plan.decision.margin);
    EXPECT_NEAR(tube.slice(tube.length()).center(2), 0, 1e-9);
    EXPECT_NEAR(tube.slice(tube.length()).center(3), 0, 1e-9);
    EXPECT_EQ(tube.slice(tube.length()).center(0), plan.end(0));
  }
}

TEST(CertifiedPlan, WithoutACertificateItHasNoControlsAndTheLastAnswer) {
  Config config = WithInitialSet(PointMass());
  auto problem = std::make_shared<Problem>(*config.problem);
  problem->declaration.noise_bound = Vec({0, 0, 10, 0});  // no tube stays in the domain
  config.problem = problem;
  const auto proposer = MakeProposer(config);
  const CertifiedPlan plan = FindCertifiedPlan(*proposer, Certifier(problem), config, 1);
  EXPECT_EQ(plan.controls.cols(), 0);
  EXPECT_EQ(plan.decision.outcome, Outcome::kDomain);
  EXPECT_GT(plan.candidates, 1);
}

}  // namespace
}  // namespace forereach
