#include "planner_bridge/proposal.h"

#include <limits>

#include <gtest/gtest.h>

#include "tests/planner/tasks.h"

namespace forereach {
namespace {

std::unique_ptr<Proposer> PlannerOf(const Config& config) {
  return MakeOmplProposer(config.problem, config.planner, config.obstacles);
}

PlanRequest From(const Eigen::VectorXd& state, std::uint32_t seed, double clearance = 0.3) {
  PlanRequest request;
  request.state = state;
  request.clearance = clearance;
  request.seed = seed;
  return request;
}

// All that a proposal promises. `rest` are the coordinates that are zero at standstill.
void ExpectSound(const Config& config, const PlanRequest& request, const Proposal& proposal, std::vector<int> rest) {
  const Problem& problem = *config.problem;
  const int n = problem.model->num_states(), steps = static_cast<int>(proposal.controls.cols());
  ASSERT_LE(steps, kMaxSteps);
  ASSERT_LE(steps - proposal.progress_steps, config.planner.tail_steps);
  ASSERT_EQ(proposal.states.cols(), steps + 1);
  EXPECT_EQ(proposal.states.col(0), request.state);
  for (int t = 0; t < steps; ++t) {
    Eigen::VectorXd z(problem.model->num_variables()), next(n);
    z << proposal.states.col(t), proposal.controls.col(t);
    ASSERT_TRUE(problem.domain.Contains({z.data(), static_cast<std::size_t>(z.size())})) << "step " << t;
    problem.model->Evaluate({z.data(), static_cast<std::size_t>(z.size())}, {next.data(), static_cast<std::size_t>(n)});
    ASSERT_EQ(next, proposal.states.col(t + 1)) << "step " << t;
    for (const Obstacle& obstacle : config.obstacles)
      ASSERT_GT(ApproximateDistance(obstacle, problem.projection * next), request.clearance) << "step " << t;
  }
  for (const int k : rest) EXPECT_NEAR(proposal.states(k, steps), 0, 1e-9);
}

TEST(Planner, BicycleProposalsAreAllowedEndAtStandstillAndComeNearer) {
  const Config config = Bicycle();
  const auto planner = PlannerOf(config);
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const PlanRequest request = From(Vec({0, 0, 0, 7, 0, 0}), seed);
    const auto proposal = planner->Propose(request);
    ASSERT_TRUE(proposal);
    EXPECT_EQ(proposal->progress_steps, config.planner.progress_steps);
    ExpectSound(config, request, *proposal, {3, 4, 5});
    EXPECT_GT(proposal->states(0, proposal->progress_steps), 3);
  }
}

// Where little can be achieved, the search must not take the nearest miss for an answer.
TEST(Planner, EveryProposalHasAllItsProgressSteps) {
  const Config config = Bicycle();
  const auto planner = PlannerOf(config);
  int found = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    for (const Eigen::VectorXd& state :
         {Vec({18, 1, 0, 2, 0, 0}), Vec({20, 1, 0, 0, 0, 0}), Vec({70, 0, 0.5, 4, 0, 0})}) {
      const PlanRequest request = From(state, seed);
      const auto proposal = planner->Propose(request);
      if (!proposal) continue;
      ++found;
      EXPECT_EQ(proposal->progress_steps, config.planner.progress_steps) << state.transpose() << ", seed " << seed;
      ExpectSound(config, request, *proposal, {3, 4, 5});
    }
  }
  EXPECT_GT(found, 10);
}

TEST(Planner, PointMassProposalsAreAllowedEndAtStandstillAndComeNearer) {
  const Config config = PointMass();
  const auto planner = PlannerOf(config);
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const PlanRequest request = From(Vec({0, 0, 1, 0}), seed);
    const auto proposal = planner->Propose(request);
    ASSERT_TRUE(proposal);
    EXPECT_EQ(proposal->progress_steps, config.planner.progress_steps);
    ExpectSound(config, request, *proposal, {2, 3});
    EXPECT_GT(proposal->states(0, proposal->progress_steps), 0.5);
  }
}

TEST(Planner, EveryAlgorithmFindsAProposal) {
  for (const char* name : {"kpiece", "est", "pdst", "rrt", "sst"}) {
    SCOPED_TRACE(name);
    Config config = Bicycle();
    config.planner.algorithm = name;
    config.planner.time_limit_ms = 60;
    const auto planner = PlannerOf(config);
    const PlanRequest request = From(Vec({0, 0, 0, 7, 0, 0}), 3);
    const auto proposal = planner->Propose(request);
    ASSERT_TRUE(proposal);
    ExpectSound(config, request, *proposal, {3, 4, 5});
  }
}

TEST(Planner, TheSameRequestGivesTheSameProposalWhateverWasAskedBefore) {
  const Config config = Bicycle();
  const auto planner = PlannerOf(config), other = PlannerOf(config);
  const PlanRequest request = From(Vec({0, 0, 0, 7, 0, 0}), 11);
  const auto first = planner->Propose(request);
  for (std::uint32_t seed = 20; seed < 25; ++seed) EXPECT_TRUE(other->Propose(From(Vec({5, 0, 0, 5, 0, 0}), seed)));
  const auto second = other->Propose(request);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->controls, second->controls);
  const auto different = planner->Propose(From(request.state, 12));
  ASSERT_TRUE(different);
  EXPECT_TRUE(first->controls.cols() != different->controls.cols() || first->controls != different->controls);
}

TEST(Planner, KeepsTheMarginFromTheDomain) {
  const Config config = Bicycle();
  const auto planner = PlannerOf(config);
  PlanRequest request = From(Vec({0, 0, 0, 7, 0, 0}), 4);
  request.domain_margin = Vec({0, 10, 0, 0, 0.2, 0.2});
  const auto proposal = planner->Propose(request);
  ASSERT_TRUE(proposal);
  EXPECT_LE(proposal->states.row(1).cwiseAbs().maxCoeff(), 5);
  EXPECT_LE(proposal->states.row(5).cwiseAbs().maxCoeff(), 0.28 + 1e-12);
}

TEST(Planner, AnObstacleNearerThanTheClearanceAtTheStartDoesNotStopIt) {
  const Config config = Bicycle();
  const auto planner = PlannerOf(config);
  const Eigen::VectorXd beside = Vec({25, -2.5, 0, 2, 0, 0});
  ASSERT_LT(ApproximateDistance(config.obstacles[0], Vec({25, -2.5})), 1);
  EXPECT_TRUE(planner->Propose(From(beside, 5, 1)));
}

TEST(Planner, NoProposalFromWhereNoneCanBe) {
  const Config config = Bicycle();
  const auto planner = PlannerOf(config);
  EXPECT_FALSE(planner->Propose(From(Vec({25, 1, 0, 0, 0, 0}), 1)));   // inside an obstacle
  EXPECT_FALSE(planner->Propose(From(Vec({0, 0, 0, 20, 0, 0}), 1)));   // outside the domain
  EXPECT_FALSE(planner->Propose(From(Vec({18, 1, 0, 10, 0, 0}), 1)));  // too fast to miss the obstacle ahead
  EXPECT_FALSE(planner->Propose(From(Vec({0, 0, 0, std::numeric_limits<double>::quiet_NaN(), 0, 0}), 1)));
  EXPECT_FALSE(planner->Propose(From(Vec({0, 0}), 1)));
}

TEST(Planner, ObstaclesCanBeReplaced) {
  Config config = Bicycle();
  const auto planner = PlannerOf(config);
  const PlanRequest blocked = From(Vec({18, 1, 0, 10, 0, 0}), 1);
  ASSERT_FALSE(planner->Propose(blocked));
  config.obstacles.clear();
  planner->SetObstacles({});
  const auto proposal = planner->Propose(blocked);
  ASSERT_TRUE(proposal);
  ExpectSound(config, blocked, *proposal, {3, 4, 5});
}

TEST(Planner, RefusesOptionsThatDoNotFit) {
  for (const auto& spoil :
       std::vector<void (*)(PlannerOptions&)>{[](PlannerOptions& options) { options.algorithm = "astar"; },
                                              [](PlannerOptions& options) { options.goal = {}; },
                                              [](PlannerOptions& options) {
                                                options.goal = {1, 2, 3};
                                              },
                                              [](PlannerOptions& options) { options.progress_steps = 0; },
                                              [](PlannerOptions& options) { options.tail_steps = kMaxSteps; }}) {
    Config config = Bicycle();
    EXPECT_NO_THROW(PlannerOf(config));
    spoil(config.planner);
    EXPECT_THROW(PlannerOf(config), std::invalid_argument);
  }
}

}  // namespace
}  // namespace forereach
