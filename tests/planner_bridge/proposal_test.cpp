#include "planner_bridge/proposal.h"

#include "tests/test.h"

#include "forereach/safety/clearance.h"
#include "tests/planner_bridge/tasks.h"

namespace forereach::proposal_test {

std::unique_ptr<Proposer> PlannerOf(const Config& config) { return MakeOmplProposer(config); }

PlanRequest From(const Eigen::VectorXd& state, std::uint32_t seed, double clearance = 0.3) {
  return {.state = state, .clearance = clearance, .seed = seed};
}

PlanRequest WithHints(PlanRequest request) {
  request.may_follow_hints = true;
  return request;
}

// All that a proposal promises.
void ExpectSound(const Config& config, const PlanRequest& request, const Proposal& proposal) {
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
  for (const RestBound& bound : *config.laws.at_rest)
    EXPECT_LE(std::abs(proposal.states(bound.coordinate, steps)), bound.tolerance);
}

struct Drive {
  const char* name;
  Config (*task)();
  Eigen::VectorXd state;
  double reaches;  // at least, along the first coordinate
  friend void PrintTo(const Drive& drive, std::ostream* out) { *out << drive.name; }
};
struct ProposalsOf : testing::TestWithParam<Drive> {};

TEST_P(ProposalsOf, AreAllowedEndAtStandstillAndComeNearer) {
  const Config config = GetParam().task();
  const auto planner = PlannerOf(config);
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const PlanRequest request = From(GetParam().state, seed);
    const auto proposal = planner->Propose(request).value();
    EXPECT_EQ(proposal.progress_steps, config.planner.progress_steps);
    ExpectSound(config, request, proposal);
    EXPECT_GT(proposal.states(0, proposal.progress_steps), GetParam().reaches);
  }
}

INSTANTIATE_TEST_SUITE_P(Each, ProposalsOf,
                         testing::Values(Drive{"Bicycle", Bicycle, Vec({0, 0, 0, 7, 0, 0}), 3},
                                         Drive{"PointMass", PointMass, Vec({0, 0, 1, 0}), 0.5}),
                         [](const auto& drive) { return drive.param.name; });

struct Planner : testing::Test {
  const Config config_ = Bicycle();
  const std::unique_ptr<Proposer> planner_ = PlannerOf(config_);
};

// Where little can be achieved, the search must not take the nearest miss for an answer.
TEST_F(Planner, EveryProposalHasAllItsProgressSteps) {
  int found = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    for (const Eigen::VectorXd& state :
         {Vec({18, 1, 0, 2, 0, 0}), Vec({20, 1, 0, 0, 0, 0}), Vec({70, 0, 0.5, 4, 0, 0})}) {
      const PlanRequest request = From(state, seed);
      const auto proposal = planner_->Propose(request);
      if (!proposal) continue;
      ++found;
      EXPECT_EQ(proposal->progress_steps, config_.planner.progress_steps) << state.transpose() << ", seed " << seed;
      ExpectSound(config_, request, *proposal);
    }
  }
  EXPECT_GT(found, 10);
}

TEST_F(Planner, EveryAlgorithmFindsAProposal) {
  for (const char* name : {"kpiece", "est", "pdst", "rrt", "sst"}) {
    SCOPED_TRACE(name);
    Config config = Bicycle();
    config.planner.algorithm = name;
    config.planner.time_limit_ms = 60;
    const auto planner = PlannerOf(config);
    const PlanRequest request = From(Vec({0, 0, 0, 7, 0, 0}), 3);
    ExpectSound(config, request, planner->Propose(request).value());
  }
}

TEST_F(Planner, TheSameRequestGivesTheSameProposalWhateverWasAskedBefore) {
  const Config config = Bicycle();
  const auto planner = PlannerOf(config), other = PlannerOf(config);
  const PlanRequest request = From(Vec({0, 0, 0, 7, 0, 0}), 11);
  const auto first = planner->Propose(request);
  for (std::uint32_t seed = 20; seed < 25; ++seed) EXPECT_TRUE(other->Propose(From(Vec({5, 0, 0, 5, 0, 0}), seed)));
  const auto second = other->Propose(request);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->controls, second->controls);
  const auto different = planner->Propose(From(request.state, 12)).value();
  EXPECT_TRUE(first->controls.cols() != different.controls.cols() || first->controls != different.controls);
}

bool AreEqual(const Proposal& one, const Proposal& other) {
  return one.controls.cols() == other.controls.cols() && one.controls == other.controls;
}

TEST_F(Planner, DoesWhatTheHintsDoWhereThereIsRoom) {
  const PlanRequest request = From(Vec({0, 0, 0, 7, 0, 0}), 1);
  const auto proposal = planner_->Propose(WithHints(request)).value();
  EXPECT_EQ(proposal.progress_steps, config_.planner.progress_steps);
  PlanRequest wider = request;
  wider.clearance += kRoomOfHints * config_.planner.clearance_step;
  ExpectSound(config_, wider, proposal);
  EXPECT_GT(proposal.states(0, proposal.progress_steps), 4.5) << "straight on";
  EXPECT_LT(proposal.states.row(1).head(proposal.progress_steps).cwiseAbs().maxCoeff(), 0.5);
  const auto another = planner_->Propose(WithHints(From(request.state, 2))), searched = planner_->Propose(request);
  ASSERT_TRUE(another && searched);
  EXPECT_TRUE(AreEqual(*another, proposal)) << "no seed has a part in it";
  EXPECT_FALSE(AreEqual(*searched, proposal));
}

// The robot drives by the first obstacle at a distance of 3.2 m.
TEST_F(Planner, SearchesWhereTheHintsHaveLessRoom) {
  const Eigen::VectorXd beside = Vec({25, -5.2, 0, 2, 0, 0});
  ASSERT_NEAR(ApproximateDistance(config_.obstacles[0], beside.head(2)), 3.2, 1e-9);
  const auto searches = [&](double clearance) {
    const PlanRequest request = From(beside, 1, clearance);
    const auto searched = planner_->Propose(request), proposed = planner_->Propose(WithHints(request));
    EXPECT_TRUE(searched && proposed) << clearance;
    return searched && proposed && AreEqual(*searched, *proposed);
  };
  const double least = 3.2 - kRoomOfHints * config_.planner.clearance_step;
  EXPECT_FALSE(searches(least - 0.2));
  EXPECT_TRUE(searches(least + 0.01));
}

TEST_F(Planner, SearchesWhereHintsAreOfNoUse) {
  Config config = PointMass();
  config.obstacles.clear();
  const std::vector<ExpressionText> hints = config.laws.hints;
  const std::vector<ExpressionText> still{{"0", 1, 1}, {"0", 1, 1}},
      undefined{{"desired_speed*vx/hypot(vx, vy)", 1, 1}, {"0", 1, 1}};
  for (const auto& of_no_use : {std::vector<ExpressionText>{}, still, undefined}) {
    config.laws.hints = of_no_use;
    config.planner.time_limit_ms = 100;
    const auto planner = PlannerOf(config);
    const PlanRequest request = From(Vec({0, 0, 0, 0}), 1);
    const auto searched = planner->Propose(request), proposed = planner->Propose(WithHints(request));
    ASSERT_TRUE(searched && proposed);
    EXPECT_TRUE(AreEqual(*searched, *proposed));
    EXPECT_GT(proposed->states(0, proposed->progress_steps), 0);
  }
  config.laws.hints = hints;
  const PlanRequest request = From(Vec({0, 0, 0, 0}), 1);
  const auto searched = PlannerOf(config)->Propose(request), proposed = PlannerOf(config)->Propose(WithHints(request));
  ASSERT_TRUE(searched && proposed);
  EXPECT_FALSE(AreEqual(*searched, *proposed)) << "otherwise the above shows nothing";
}

TEST_F(Planner, ProposalsByHintsKeepTheMargins) {
  const Config config = Bicycle();
  PlanRequest request = WithHints(From(Vec({0, 3, 0, 7, 0, 0}), 1));
  const auto planner = PlannerOf(config);
  const auto free = planner->Propose(request).value();
  request.domain_margin = Vec({0, 0, 0, 0, 0.2, 0.48 - free.states.row(5).cwiseAbs().maxCoeff() + 1e-6});
  request.seed = 4;
  const auto proposal = planner->Propose(request).value();
  EXPECT_LT(proposal.states.row(5).cwiseAbs().maxCoeff(), free.states.row(5).cwiseAbs().maxCoeff());
}

TEST_F(Planner, KeepsTheMarginFromTheDomain) {
  PlanRequest request = From(Vec({0, 0, 0, 7, 0, 0}), 4);
  request.domain_margin = Vec({0, 10, 0, 0, 0.2, 0.2});
  const auto proposal = planner_->Propose(request).value();
  EXPECT_LE(proposal.states.row(1).cwiseAbs().maxCoeff(), 5);
  EXPECT_LE(proposal.states.row(5).cwiseAbs().maxCoeff(), 0.28 + 1e-12);
}

TEST_F(Planner, AnObstacleNearerThanTheClearanceAtTheStartDoesNotStopIt) {
  const Eigen::VectorXd beside = Vec({25, -2.5, 0, 2, 0, 0});
  ASSERT_LT(ApproximateDistance(config_.obstacles[0], Vec({25, -2.5})), 1);
  EXPECT_TRUE(planner_->Propose(From(beside, 5, 1)));
}

TEST_F(Planner, ProposesNothingFromAnObstacleFromOutsideTheDomainOrWithoutRoomToStop) {
  EXPECT_FALSE(planner_->Propose(From(Vec({25, 1, 0, 0, 0, 0}), 1)));   // inside an obstacle
  EXPECT_FALSE(planner_->Propose(From(Vec({0, 0, 0, 20, 0, 0}), 1)));   // outside the domain
  EXPECT_FALSE(planner_->Propose(From(Vec({18, 1, 0, 10, 0, 0}), 1)));  // too fast to miss the obstacle ahead
  EXPECT_FALSE(planner_->Propose(From(Vec({0, 0, 0, std::numeric_limits<double>::quiet_NaN(), 0, 0}), 1)));
  EXPECT_FALSE(planner_->Propose(From(Vec({0, 0}), 1)));
}

TEST_F(Planner, ObstaclesCanBeReplaced) {
  Config config = Bicycle();
  const auto planner = PlannerOf(config);
  const PlanRequest blocked = From(Vec({18, 1, 0, 10, 0, 0}), 1);
  ASSERT_FALSE(planner->Propose(blocked));
  config.obstacles.clear();
  planner->SetObstacles({});
  ExpectSound(config, blocked, planner->Propose(blocked).value());
}

// The bicycle with a car's rectangle, to be certified at all times.
Config Car() {
  Config config = Bicycle();
  Problem& problem = Own(config.problem);
  problem.body = {.heading = 2, .parts = {{{{-1, -0.9, 0}, {3.3, -0.9, 0}, {3.3, 0.9, 0}, {-1, 0.9, 0}}, 0}}};
  problem.between = Between{Vec({25, 25}), 2.3, 6, 0.1};  // its data turn at up to 2.26 rad/s
  return config;
}

// At twenty times in each step the body, moved along the chord of its poses, keeps the clearance and its own deviation.
void ExpectClear(const Config& config, const PlanRequest& request, const Proposal& proposal) {
  const Problem& problem = *config.problem;
  const BodyPlaces places(*problem.model, problem.projection, problem.body);
  const auto pose = [&](int t, double s) -> Eigen::VectorXd {
    return (1 - s) * proposal.states.col(t) + s * proposal.states.col(t + 1);
  };
  for (int t = 0; t < proposal.controls.cols(); ++t)
    for (int i = 0; i <= 20; ++i) {
      const double s = i / 20.0;
      const Eigen::VectorXd x = pose(t, s);
      const auto placed = places.At({x.data(), static_cast<std::size_t>(x.size())});
      const auto time =
          request.schedule.start_us + std::llround((t + s) * static_cast<double>(request.schedule.step_us));
      for (const Obstacle& obstacle : config.obstacles)
        for (std::size_t part = 0; part < placed.size(); ++part)
          ASSERT_GT(ApproximateDistance(obstacle, placed[part], time),
                    request.clearance + (problem.between ? Deviation(*problem.between, problem.body.parts[part]) : 0) -
                        1e-3)  // the chord of the poses is not that of the points
              << "step " << t << " + " << s;
    }
}

TEST_F(Planner, KeepsTheBodyAwayFromObstaclesFromSampleToSample) {
  const Config config = Car();
  const auto planner = PlannerOf(config);
  int found = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (const Eigen::VectorXd& state : {Vec({0, 0, 0, 7, 0, 0}), Vec({16, -3, -0.2, 5, 0, 0})}) {
      const PlanRequest request = From(state, seed);
      const auto proposal = planner->Propose(request);
      if (!proposal) continue;
      ++found;
      ExpectClear(config, request, *proposal);
      ExpectSound(config, request, *proposal);
    }
  }
  EXPECT_GT(found, 25);
}

TEST_F(Planner, TheBodyCountsAndNotOnlyItsPoint) {
  const Eigen::VectorXd beside = Vec({25, -2.6, 0, 2, 0, 0});  // the point is 0.6 m away, the body reaches 0.9 m
  EXPECT_TRUE(PlannerOf(Bicycle())->Propose(From(beside, 5)));
  EXPECT_FALSE(PlannerOf(Car())->Propose(From(beside, 5)));
}

// A wall ahead that drives on leaves the way free; one that comes towards the robot does not.
TEST_F(Planner, MeetsMovingObstaclesWhereTheyAreAtEachStep) {
  Config config = Car();
  const Obstacle ahead = Obstacle::AxisBox(Vec({14, -15}), Vec({16, 15}));
  ObstacleMotion motion{.stamp_us = 5'000'000, .velocity = {10, 0, 0}};
  PlanRequest request = From(Vec({0, 0, 0, 10, 0, 0}), 1);
  request.schedule = {5'000'000, 100'000, 10'000};
  const auto proposed = [&](const std::vector<Obstacle>& obstacles) {
    config.obstacles = obstacles;
    return PlannerOf(config)->Propose(request);
  };
  EXPECT_FALSE(proposed({ahead}));
  ExpectClear(config, request, proposed({ahead.Moving(motion)}).value());
  motion.velocity = {-30, 0, 0};
  EXPECT_FALSE(proposed({Obstacle::AxisBox(Vec({60, -15}), Vec({62, 15})).Moving(motion)}));
  motion.until_us = 5'400'000;  // gone before they meet
  EXPECT_TRUE(proposed({Obstacle::AxisBox(Vec({60, -15}), Vec({62, 15})).Moving(motion)}));
}

// A crate stands in the way until it is taken away.
TEST_F(Planner, GoesStraightOnWhereAnObstacleHasGone) {
  Config config = Car();
  ObstacleMotion until;
  until.until_us = 4'000'000;
  config.obstacles = {Obstacle::AxisBox(Vec({20, -3}), Vec({22, 15})).Moving(until)};
  const auto planner = PlannerOf(config);
  PlanRequest request = WithHints(From(Vec({0, 0, 0, 5, 0, 0}), 1));
  const auto ends_at = [&](std::int64_t start_us) {
    request.schedule = {start_us, 100'000, 10'000};
    const auto proposal = planner->Propose(request);
    return proposal ? proposal->states(1, proposal->progress_steps) : std::nan("");
  };
  EXPECT_LT(ends_at(1'000'000), -0.1) << "around it";
  EXPECT_NEAR(ends_at(5'000'000), 0, 0.02);
}

// A robot that can back off ends its plans only where it could drive on: straight ahead, or along its hints.
TEST(PlannerHints, EndsBeforeAWallOnlyIfTheyLeadAroundIt) {
  Config config = Bicycle();
  config.laws.back_off = {{"(min(max((-0.4 - v)/0.6, -1.5), 0.85) - a)/dt"}, {"-delta/dt"}};
  const PlanRequest request = From(Vec({0, 0, 0, 2, 0, 0}), 1);
  const auto proposes = [&](double wall_ends_at) {
    config.obstacles = {Obstacle::AxisBox(Vec({10, wall_ends_at}), Vec({11, 15}))};
    return PlannerOf(config)->Propose(request).has_value();
  };
  EXPECT_TRUE(proposes(-2));
  EXPECT_FALSE(proposes(-15));
  config.laws.hints.clear();
  EXPECT_FALSE(proposes(-2));
}

Limit AtMost(const char* that, double bound) { return {.name = that, .that = {that, 1, 1}, .at_most = bound}; }

// The point mass with limits of its speed, 1.2 m/s, and of its acceleration.
Config Limited() {
  Config config = PointMass();
  Own(config.problem).limits = {AtMost("vx^2 + vy^2", 1.44), AtMost("abs(ax)", 1)};
  config.planner.braking = 0.8;
  for (ModelText::Definition& definition : config.laws.definitions)
    if (definition.name == "hardest") definition.value.text = "0.8";
  return config;
}

// The least room of each limit in a proposal.
std::vector<double> Room(const Config& config, const Proposal& proposal) {
  std::vector<double> room(config.problem->limits.size(), kInfinity);
  for (Eigen::Index t = 0; t < proposal.states.cols(); ++t) {
    const auto x = proposal.states.col(t);
    room[0] = std::min(room[0], 1.44 - x[2] * x[2] - x[3] * x[3]);
    if (t < proposal.controls.cols()) room[1] = std::min(room[1], 1 - std::abs(proposal.controls(0, t)));
  }
  return room;
}

TEST_F(Planner, KeepsLimitsOfStatesAndInputsByTheMarginThatIsAskedFor) {
  const Config config = Limited();
  Config without = config;
  Problem problem = *config.problem;
  problem.limits.clear();
  without.problem = std::make_shared<const Problem>(problem);
  int found = 0, faster = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    PlanRequest request = From(Vec({0, 0, 0.9, 0}), seed);
    request.limit_margin = {0.25, 0.125};
    const auto proposal = PlannerOf(config)->Propose(request), free = PlannerOf(without)->Propose(request);
    if (free) faster += Room(config, *free)[0] < 0 && Room(config, *free)[1] < 0;
    if (!proposal) continue;
    ++found;
    ExpectSound(config, request, *proposal);
    EXPECT_GE(Room(config, *proposal)[0], 0.25);
    EXPECT_GE(Room(config, *proposal)[1], 0.125);
  }
  EXPECT_GT(found, 10);
  EXPECT_GT(faster, 3) << "otherwise the limits show nothing";
}

TEST_F(Planner, AStartNearerToALimitThanTheMarginDoesNotStopItButOneBeyondDoes) {
  const auto planner = PlannerOf(Limited());
  PlanRequest request = From(Vec({0, 0, 1.1, 0}), 3);
  request.limit_margin = {0.5, 0};
  EXPECT_TRUE(planner->Propose(request));
  request.state[2] = 1.25;
  EXPECT_FALSE(planner->Propose(request));
}

// Each part of the arm keeps the clearance, and its deviation between the samples.
TEST_F(Planner, KeepsPartsAtExpressionsAwayFromObstacles) {
  const Config config = LoadConfig(FOREREACH_SOURCE_DIR "/config/drive/reaching_arm.yaml");
  const Problem& problem = *config.problem;
  const BodyPlaces places(*problem.model, problem.projection, problem.body);
  const auto least = [&](const Proposal& proposal) {
    double distance = kInfinity;
    for (Eigen::Index t = 0; t < proposal.states.cols(); ++t)
      for (const BodyPart& part : places.At({proposal.states.col(t).data(), 4}))
        for (const Obstacle& obstacle : config.obstacles)
          distance = std::min(distance, ApproximateDistance(obstacle, part));
    return distance;
  };
  int found = 0;
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const PlanRequest request = From(Vec({-0.2, 0.9, 0.4, 0}), seed, 0.05);
    const auto proposal = PlannerOf(config)->Propose(request);
    if (!proposal) continue;
    ++found;
    EXPECT_GT(least(*proposal), 0.05 + Deviation(*problem.between, problem.body.parts[1]));
  }
  EXPECT_GT(found, 5);
}

TEST_F(Planner, RefusesOptionsThatDoNotFit) {
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

}  // namespace forereach::proposal_test
