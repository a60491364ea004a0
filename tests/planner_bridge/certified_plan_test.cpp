#include "planner_bridge/certified_plan.h"

#include "tests/test.h"

#include "forereach/certify/tube.h"
#include "planner_bridge/lessons.h"
#include "planner_bridge/proposal.h"
#include "tests/planner_bridge/tasks.h"

namespace forereach::certified_plan_test {

Config WithInitialSet(Config config) {
  const Eigen::VectorXd center = Vec({0, 0, 0, 0}), half_width = Vec({0.05, 0.05, 0.03, 0.03});
  config.initial_set = Box(center - half_width, center + half_width);
  return config;
}

TEST(CertifiedPlan, TakesThePointMassToTheGoalInOnePlanThatEndsInAStop) {
  Config config = WithInitialSet(PointMass());
  config.planner.tail_steps = 20;
  const Certifier certifier(config.problem);
  for (std::uint32_t seed = 1; seed <= 16; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    config.planner.certifies = seed > 8;  // then each part continues the tube of those before it
    const auto proposer = MakeProposer(config);
    const CertifiedPlan plan = FindCertifiedPlan(*proposer, certifier, config, seed);
    ASSERT_GT(plan.controls.cols(), 0);
    EXPECT_TRUE(plan.reaches_goal);
    EXPECT_LT(plan.progress_steps, plan.controls.cols());
    const Plan again{plan.controls.data(), 2, static_cast<int>(plan.controls.cols()), 2};
    Tube tube;
    const Decision decision = certifier.Certify(again, Zonotope::Enclose(config.initial_set), config.obstacles, tube);
    EXPECT_FIELDS(decision, (outcome, Outcome::kCertified), (margin, plan.decision.margin));
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
  EXPECT_FIELDS(plan, (controls.cols(), 0), (decision.outcome, Outcome::kDomain));
  EXPECT_GT(plan.candidates, 1);
}

// The tube's half-width of 0.03 m/s counts: a nominal speed at the limit is not certified.
TEST(CertifiedPlan, LearnsTheMarginFromALimit) {
  Config config = WithInitialSet(PointMass());
  auto problem = std::make_shared<Problem>(*config.problem);
  config.planner.cruise_speed = 1;
  problem->limits = {{.name = "forwards", .that = {"vx", 1, 1}, .at_most = 1}};
  config.problem = problem;
  config.planner.tail_steps = 20;
  const auto proposer = MakeProposer(config);
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    EXPECT_TRUE(FindCertifiedPlan(*proposer, Certifier(problem), config, seed).reaches_goal);
  }
}

struct SearchThatCertifies : testing::Test {
  SearchThatCertifies() {
    config_.planner.certifies = true;
    config_.planner.clearance = 0;
    initial_set_ = std::make_shared<const Zonotope>(Zonotope::FromBox(
        Eigen::VectorXd::Zero(6), Eigen::Map<const Eigen::VectorXd>(config_.planner.initial_half_width.data(), 6)));
  }
  std::optional<Proposal> Propose(std::uint32_t seed) const {
    PlanRequest request{.state = Eigen::VectorXd::Zero(6), .clearance = 0, .seed = seed};
    request.initial_set = initial_set_;
    return MakeOmplProposer(config_)->Propose(request);
  }
  Decision Decide(const Proposal& proposal) const {
    const Eigen::MatrixXd& controls = proposal.controls;
    Tube tube;
    return Certifier(config_.problem)
        .Certify({controls.data(), 2, static_cast<int>(controls.cols()), 2}, *initial_set_, config_.obstacles, tube);
  }

  Config config_ = Between(Bicycle());
  std::shared_ptr<const Zonotope> initial_set_;

 private:
  // Circles to both sides, so near that a plan without clearance may touch them.
  static Config Between(Config config) {
    config.obstacles = {Obstacle::Circle(Vec({9, 2}), 1.2), Obstacle::Circle(Vec({9, -2}), 1.2)};
    return config;
  }
};

TEST_F(SearchThatCertifies, ProposesNothingThatIsNotCertified) {
  for (const std::string algorithm : {"kpiece", "est", "pdst", "rrt", "sst"}) {
    config_.planner.algorithm = algorithm;
    int found = 0;
    for (std::uint32_t seed = 1; seed <= 10; ++seed) {
      SCOPED_TRACE(algorithm + ", seed " + std::to_string(seed));
      const std::optional<Proposal> proposal = Propose(seed);
      if (!proposal) continue;
      ++found;
      EXPECT_EQ(Decide(*proposal).outcome, Outcome::kCertified);
    }
    EXPECT_GT(found, 3) << algorithm;
  }
}

TEST_F(SearchThatCertifies, FindsNothingWithoutAnInitialSet) {
  initial_set_ = nullptr;
  EXPECT_FALSE(Propose(1));
}

TEST(Lessons, AnExceededLimitAddsTheExcessOfTheTubeToItsMargin) {
  Lessons lessons(PlannerOptions{}, 2);
  Decision decision{
      .outcome = Outcome::kSafety, .cause = Cause::kLimit, .coordinate = 1, .margin = -3.5, .threshold = -3};
  lessons.Learn(decision);
  decision.margin = 4.25;
  decision.threshold = 4;
  lessons.Learn(decision);
  for (const double margin : {kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    decision.margin = margin;
    lessons.Learn(decision);
  }
  decision.margin = 9;
  for (const int coordinate : {-1, 2, 1000}) {
    decision.coordinate = coordinate;
    lessons.Learn(decision);
  }
  EXPECT_FIELDS(lessons, (limit_margin(), (std::vector<double>{0, 0.75})), (clearance(), PlannerOptions{}.clearance));
  decision.cause = Cause::kObstacle;
  lessons.Learn(decision);
  EXPECT_GT(lessons.clearance(), PlannerOptions{}.clearance);
}

advice_t Advised(std::int16_t kind, int index, double value, std::int16_t count = 1) {
  advice_t advice{.num_changes = count};
  advice.change[0].kind = kind;
  advice.change[0].index = static_cast<std::int16_t>(index);
  advice.change[0].value = value;
  return advice;
}

TEST(Lessons, AnAdviceSetsTheClearancesThatItNames) {
  PlannerOptions options;
  options.clearance = 0.5;
  Lessons lessons(options, 2);
  const auto to_the_last = [&] {
    return std::pair(lessons.obstacle_clearance().back().clearance, lessons.obstacle_clearance().back().first_step);
  };
  advice_t advice = Advised(advice_change_t::OBSTACLE, 3, 0.25);
  advice.change[0].step = 20;
  EXPECT_TRUE(lessons.Heed(advice));
  EXPECT_FIELDS(lessons, (obstacle_clearance().size(), 4u), (obstacle_clearance()[2].clearance, 0));
  EXPECT_EQ(to_the_last(), std::pair(0.75, 20)) << "it does not say where the plan was";
  advice.change[0].clearance = 1.5;
  advice.change[0].step = 30;
  EXPECT_TRUE(lessons.Heed(advice));
  EXPECT_EQ(to_the_last(), std::pair(1.5, 20));
  advice.change[0].step = 10;
  EXPECT_TRUE(lessons.Heed(advice));
  EXPECT_EQ(to_the_last(), std::pair(1.75, 10)) << "as much was kept before, and was not enough";
  lessons.Ease();
  EXPECT_EQ(to_the_last(), std::pair(1.125, 10));
  EXPECT_EQ(lessons.clearance(), 0.5) << "to the others as before";
  EXPECT_TRUE(lessons.Heed(Advised(advice_change_t::LIMIT, 1, 0.75)));
  EXPECT_EQ(lessons.limit_margin(), (std::vector<double>{0, 0.75}));
  EXPECT_TRUE(lessons.Heed(Advised(advice_change_t::DOMAIN, 2, 0.125)));
  const Eigen::VectorXd half_width = Eigen::VectorXd::Constant(3, 1);
  EXPECT_EQ(lessons.DomainMargin(half_width, Eigen::MatrixXd::Identity(1, 3)), Eigen::Vector3d(0, 0, 0.125));
}

// Where there are no keys anybody may have sent it.
TEST(Lessons, AFalseAdviceChangesNoMargin) {
  Lessons lessons(PlannerOptions{}, 2);
  for (const int kind : {-1, 0, 1, 2, 3, 4, 32767})
    for (const int index : {-32768, -1, 0, 2, 32767})
      for (const double value : {-1.0, 0.0, kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()})
        EXPECT_FALSE(lessons.Heed(Advised(static_cast<std::int16_t>(kind), index, value)));
  for (const int count : {-32768, -1, 0})
    EXPECT_FALSE(lessons.Heed(Advised(advice_change_t::OBSTACLE, 0, 1, static_cast<std::int16_t>(count))));
  EXPECT_FALSE(lessons.Heed(Advised(advice_change_t::LIMIT, 2, 1)));
  EXPECT_TRUE(lessons.Heed(Advised(advice_change_t::OBSTACLE, 0, 1, 32767))) << "there are eight changes";
  EXPECT_TRUE(lessons.Heed(Advised(advice_change_t::DOMAIN, 32767, 1))) << "no such state: nothing keeps away from it";
  EXPECT_EQ(lessons.DomainMargin(Eigen::Vector2d(1, 1), Eigen::MatrixXd::Identity(1, 2)), Eigen::Vector2d(0, 0));
}

}  // namespace forereach::certified_plan_test
