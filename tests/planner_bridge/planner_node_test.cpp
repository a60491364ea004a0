#include "planner_bridge/planner_node.h"

#include "tests/test.h"

#include "bus/log.h"
#include "forereach/numerics/directed.h"
#include "lcmtypes/seal.h"
#include "task/canonical.h"
#include "tests/messages.h"
#include "tests/planner_bridge/tasks.h"

namespace forereach::planner_node_test {

constexpr std::int64_t kNow = 1'700'000'000'000'000, kPeriod = 40'000;

/** A planner node with the test as its robot and certifier. */
struct PlannerNodeTest : testing::Test {
  void SetUp() override { Start(Bicycle()); }

  void Start(const Config& config) {
    config_ = config;
    bus_ = OpenBus("memq://", [this] { return now_; });
    node_ = std::make_unique<PlannerNode>(config_, *bus_, out_);
    Hear(*bus_, config_.bus.candidate, candidates_);
    Run(1);
  }

  void Deliver() {
    while (bus_->Dispatch(0) > 0) {
    }
  }

  // Ticks once a millisecond.
  void Run(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) {
      now_ += 1000;
      node_->Tick(now_);
      Deliver();
    }
  }

  void StartOnTheBus(double timeout_ms = 1000) {
    Config config = Bicycle();
    config.gate.obstacles = ObstaclesSource::kBus;
    config.gate.obstacles_timeout_ms = timeout_ms;
    Start(config);
  }

  robot_state_t Standing(double x = 0, double y = 0, std::int64_t sequence = 0) {
    robot_state_t state = StateOf(now_, sequence);
    state.num_states = 6;
    state.state[0] = x, state.state[1] = y;
    return state;
  }

  robot_state_t Executing(const candidate_plan_t& plan, int step) {
    robot_state_t state = StateOf(now_, 0, plan.plan_id, step);
    state.num_states = 6;
    std::copy_n(plan.initial_center, 6, state.state);
    std::array<double, 8> z;
    for (int t = 0; t < step; ++t) {
      std::copy_n(plan.control[t], 2, std::copy_n(state.state, 6, z.begin()));
      config_.problem->model->Evaluate(z, {state.state, 6});
    }
    return state;
  }

  decision_t Decision(const candidate_plan_t& candidate, std::int16_t outcome, std::int16_t cause) {
    decision_t decision{.utime = now_, .candidate_utime = candidate.utime, .plan_id = candidate.plan_id};
    std::copy(std::begin(candidate.source), std::end(candidate.source), decision.source);
    decision.outcome = outcome;
    decision.cause = cause;
    return decision;
  }

  template <class Message>
  void Publish(const std::string& channel, const Message& message) {
    ASSERT_TRUE(bus_->Publish(channel, message));
    Deliver();
  }
  void Say(const robot_state_t& state) { Publish(config_.bus.robot_state, state); }
  void Say(const decision_t& decision) { Publish(config_.bus.decision, decision); }
  void Say(const advice_t& advice) { Publish(config_.bus.advice, advice); }
  void Say(const obstacles_t& obstacles) { Publish(config_.bus.obstacles, obstacles); }
  // And lets it plan.
  template <class Message>
  void Tell(const Message& message) {
    Say(message);
    Run(3);
  }
  void Certify() { Say(Decision(candidates_.back(), decision_t::CERTIFIED, decision_t::CAUSE_NONE)); }
  void AbstainS() { Say(Decision(candidates_.back(), decision_t::ABSTAIN_SAFETY, decision_t::CAUSE_OBSTACLE)); }

  // The robot is at a step of a plan.
  void ReachStep(const candidate_plan_t& plan, int step) {
    now_ = plan.start_utime + step * kPeriod;
    Tell(Executing(plan, step));
  }
  // At which the next plan has to be found.
  [[nodiscard]] int DueStep(const candidate_plan_t& plan) const {
    return plan.progress_steps - config_.planner.lead_steps;
  }

  nlohmann::json Summary() const { return nlohmann::json::parse(node_->Summary()); }

  // The nominal rollout's smallest distance to the obstacles.
  double Clearance(const candidate_plan_t& plan) {
    double least = std::numeric_limits<double>::infinity();
    for (int t = 0; t <= plan.num_steps; ++t) {
      const robot_state_t state = Executing(plan, t);
      for (const Obstacle& obstacle : config_.obstacles)
        least = std::min(least, ApproximateDistance(obstacle, Vec({state.state[0], state.state[1]})));
    }
    return least;
  }

  Config config_;
  std::int64_t now_ = kNow;
  std::ostringstream out_;
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<PlannerNode> node_;
  std::vector<candidate_plan_t> candidates_;
};

TEST_F(PlannerNodeTest, SaysNothingBeforeItHearsOfTheRobot) {
  Run(100);
  EXPECT_TRUE(candidates_.empty());
}

TEST_F(PlannerNodeTest, WhileTheRobotComesToRestNothingIsPlanned) {
  robot_state_t state = Standing();
  state.state[3] = std::nextafter(config_.planner.initial_half_width[3], 1);
  Tell(state);
  EXPECT_TRUE(candidates_.empty()) << "it will be somewhere else";
  ++state.sequence;
  state.state[3] = -config_.planner.initial_half_width[3];
  Tell(state);
  EXPECT_EQ(candidates_.size(), 1u);
}

// So that a guard, which asks for all of the measured state +- its error inside X0, lets it start.
TEST_F(PlannerNodeTest, TheX0OfACandidateIsWidenedByTheStateError) {
  Problem& problem = Own(config_.problem);
  problem.declaration.state_error = Vec({0.03, 0.1, 0, 0, 0, 0});
  problem.declaration.given_are_exact = true;
  Start(config_);
  robot_state_t state = Standing();
  Tell(state);
  ASSERT_EQ(candidates_.size(), 1u);
  const std::vector<double>& given = config_.planner.initial_half_width;
  EXPECT_FIELDS(candidates_[0], (initial_half_width[0], AddUp(given[0], 0.03)),
                (initial_half_width[1], AddUp(given[1], 0.1)), (initial_half_width[2], given[2]));

  Start(config_);
  state.num_state_errors = 6;
  state.state_error[2] = 0.5;
  Tell(state);
  ASSERT_GE(candidates_.size(), 2u);
  EXPECT_EQ(candidates_.back().initial_half_width[0], given[0]) << "the state's own errors count instead";
  EXPECT_EQ(candidates_.back().initial_half_width[2], AddUp(given[2], 0.5));
  state.state_error[2] = -0.5;
  const std::size_t before = candidates_.size();
  Start(config_);
  Tell(state);
  EXPECT_EQ(candidates_.size(), before) << "a state with such an error is none";
}

// Each measured state +- error contains the true one.
TEST_F(PlannerNodeTest, PredictsTheStartFromWhatAllMeasurementsLeave) {
  Problem& problem = Own(config_.problem);
  problem.declaration.state_error = Vec({0.03, 0.03, 0, 0, 0, 0});
  problem.declaration.given_are_exact = true;
  config_.planner.candidates = 1;
  Start(config_);
  const auto starts_from = [this, begin = now_](double x, std::int64_t sequence) {
    now_ = begin + sequence * kPeriod;
    Tell(Standing(x, 0, sequence));
    const double center = candidates_.back().initial_center[0];
    AbstainS();
    Run(1);
    return center;
  };
  EXPECT_EQ(starts_from(0.03, 0), 0.03);
  EXPECT_DOUBLE_EQ(starts_from(-0.01, 1), 0.02);
  EXPECT_DOUBLE_EQ(starts_from(0.01, 2), 0.02) << "nothing new";
  EXPECT_DOUBLE_EQ(starts_from(0.06, 3), 0.03);
  EXPECT_EQ(candidates_.size(), 4u);
  EXPECT_EQ(starts_from(0.01, 5), 0.01) << "of the time between nothing is known";
}

TEST_F(PlannerNodeTest, APlanMovesTheEstimateAlong) {
  Problem& problem = Own(config_.problem);
  problem.declaration.state_error = Vec({0.03, 0.03, 0, 0.02, 0, 0});
  problem.declaration.given_are_exact = true;
  Start(config_);
  Tell(Standing());
  Certify();
  const candidate_plan_t first = candidates_.back();
  const auto say = [&](int step, double x) {
    now_ = first.start_utime + step * kPeriod;
    robot_state_t state = Executing(first, step);
    state.state[0] += x;
    Tell(state);
  };
  say(DueStep(first) - 1, 0.025);
  ASSERT_EQ(candidates_.size(), 1u);
  say(DueStep(first), -0.025);
  ASSERT_EQ(candidates_.size(), 2u);
  const double planned = Executing(first, first.progress_steps).state[0];
  EXPECT_NEAR(candidates_.back().initial_center[0], planned + 0.005, 1e-9);
}

TEST_F(PlannerNodeTest, ACandidateHasEveryFieldSet) {
  const robot_state_t state = Standing();
  Tell(state);
  const candidate_plan_t& plan = Only(candidates_);
  EXPECT_EQ(plan.utime, now_ - 2000);
  EXPECT_EQ(plan.sequence, 0);
  EXPECT_EQ(plan.plan_id, plan.utime);  // so it grows over restarts
  EXPECT_EQ(GetText(plan.source), PlannerNode::kSource);
  EXPECT_FIELDS(plan, (start_utime, state.utime + config_.planner.lead_steps * kPeriod), (step_us, kPeriod),
                (num_states, 6), (num_inputs, 2), (progress_steps, config_.planner.progress_steps));
  EXPECT_LE(plan.num_steps, plan.progress_steps + config_.planner.tail_steps);
  for (int k = 0; k < 6; ++k) {
    EXPECT_EQ(plan.initial_center[k], state.state[k]);
    EXPECT_EQ(plan.initial_half_width[k], config_.planner.initial_half_width[static_cast<std::size_t>(k)]);
  }
  for (int t = plan.num_steps; t < 128; ++t) EXPECT_EQ(plan.control[t][0], 0);
  EXPECT_NEAR(Executing(plan, plan.num_steps).state[3], 0, 1e-9);
}

TEST_F(PlannerNodeTest, SendsOneCandidateAndWaitsForItsDecision) {
  Say(Standing());
  Run(60);
  EXPECT_EQ(candidates_.size(), 1u);
  AbstainS();
  Run(3);
  ASSERT_EQ(candidates_.size(), 2u);
  EXPECT_EQ(candidates_[1].sequence, 1);
  EXPECT_GT(candidates_[1].plan_id, candidates_[0].plan_id);
  EXPECT_EQ(candidates_[1].start_utime, candidates_[0].start_utime);
}

// What the hints do is the same each time: a start that it was refused for gets a search.
TEST_F(PlannerNodeTest, FollowsTheHintsOnceForEachStart) {
  Config config = Bicycle();
  config.planner.candidates = 1;
  const auto controls = [](const candidate_plan_t& plan) {
    return std::vector<double>(&plan.control[0][0], &plan.control[0][0] + kMaxSteps * kMaxInputs);
  };
  std::vector<std::vector<double>> first, later;
  for (const int seed : {1, 2}) {
    config.planner.seed = seed;
    candidates_.clear();
    Start(config);
    robot_state_t state = Standing();
    Tell(state);
    first.push_back(controls(Only(candidates_)));
    for (std::size_t round = 2; round <= 3; ++round) {
      AbstainS();
      Run(3);
      state.utime = now_;
      ++state.sequence;
      Tell(state);
      ASSERT_EQ(candidates_.size(), round);
      later.push_back(controls(candidates_.back()));
    }
    Certify();
    now_ += 10 * kPeriod;
    Tell(Standing(0.5, 0, 9));
    ASSERT_EQ(candidates_.size(), 4u);
    first.push_back(controls(candidates_.back()));
  }
  EXPECT_EQ(first[0], first[2]) << "the hints, whatever the seed is";
  EXPECT_EQ(first[1], first[3]) << "and again from another start";
  EXPECT_NE(first[0], later[0]);
  EXPECT_NE(later[0], later[1]);
  EXPECT_NE(later[0], later[2]);
}

TEST_F(PlannerNodeTest, KeepsFurtherAwayAfterEachAbstentionS) {
  config_.planner.lead_steps = 20;  // time for all of them
  config_.planner.clearance_step = 0.5;
  Start(config_);
  robot_state_t state = Standing(8);
  state.state[3] = 5;  // it comes to rest still
  Tell(state);
  ASSERT_EQ(candidates_.size(), 0u);
  state.state[3] = 0;
  ++state.sequence;
  state.state[1] = 3.5;
  Say(state);
  for (int i = 1; i <= 6; ++i) {
    Run(3);
    ASSERT_EQ(candidates_.size(), static_cast<std::size_t>(i));
    EXPECT_GT(Clearance(candidates_.back()), config_.planner.clearance + (i - 1) * config_.planner.clearance_step);
    EXPECT_EQ(candidates_.back().initial_center[3], 0);
    AbstainS();
  }
}

struct AdvisedPlannerTest : PlannerNodeTest {
  void SetUp() override {
    config_ = Bicycle();
    config_.gate.advises = true;
    config_.planner.lead_steps = 20;
    config_.planner.clearance_step = 0;
    Start(config_);
    Tell(Standing(8, 3.5));
    ASSERT_EQ(candidates_.size(), 1u);
  }

  // As an answer to the last candidate.
  void AbstainOn(const candidate_plan_t& candidate) {
    decision_t decision = Decision(candidate, decision_t::ABSTAIN_SAFETY, decision_t::CAUSE_OBSTACLE);
    SetDigest(decision.plan_digest, PlanDigest(candidate));
    Say(decision);
  }
  // Half a metre more to every obstacle.
  advice_t Advice() {
    advice_t advice{};
    SetText(advice.source, PlannerNode::kSource);
    SetDigest(advice.plan_digest, PlanDigest(candidates_.back()));
    SetDigest(advice.obstacles_digest, ObstaclesDigest(config_.obstacles));
    for (std::size_t o = 0; o < std::min<std::size_t>(config_.obstacles.size(), 8); ++o) {
      advice_change_t& change = advice.change[advice.num_changes++];
      change.kind = advice_change_t::OBSTACLE;
      change.index = static_cast<std::int16_t>(o);
      change.value = 0.5;
    }
    return advice;
  }
};

TEST_F(AdvisedPlannerTest, GivesWayAsItIsTold) {
  ASSERT_LE(config_.obstacles.size(), 8u);
  const double before = Clearance(candidates_[0]);
  AbstainOn(candidates_[0]);
  Run(3);
  ASSERT_EQ(candidates_.size(), 1u) << "it waits for the advice";
  Say(Advice());
  Run(3);
  ASSERT_EQ(candidates_.size(), 2u);
  EXPECT_GT(Clearance(candidates_[1]), config_.planner.clearance + 0.5) << "before: " << before;
  EXPECT_EQ(Summary()["advised"], 1);
}

TEST_F(AdvisedPlannerTest, WaitsNoLongerThanTwiceTheBudgetOfADecision) {
  AbstainOn(candidates_[0]);
  const auto wait = static_cast<int>(2 * config_.gate.decision_budget_ms);
  Run(wait - 1);
  EXPECT_EQ(candidates_.size(), 1u);
  Run(3);
  EXPECT_EQ(candidates_.size(), 2u);
  EXPECT_EQ(Summary()["advised"], 0);
}

TEST_F(AdvisedPlannerTest, IgnoresAdviceThatIsNotOnItsCandidate) {
  const std::int64_t ignored = Summary()["messages_ignored"];
  Say(Advice());  // nothing was abstained on
  AbstainOn(candidates_[0]);
  advice_t other = Advice();
  other.plan_digest[31] ^= 1;
  Say(other);
  advice_t elsewhere = Advice();
  elsewhere.obstacles_digest[0] ^= 1;
  Say(elsewhere);
  advice_t empty = Advice();
  empty.num_changes = 0;
  Say(empty);
  EXPECT_THAT(Summary(), Holds({{"messages_ignored", ignored + 4}, {"advised", 0}}));
  Say(Advice());
  Say(Advice());  // repeated
  EXPECT_EQ(Summary()["advised"], 1);
  EXPECT_EQ(Summary()["messages_ignored"], ignored + 5);
}

// With no keys anybody can say this; with them, a certifier that is wrong.
TEST_F(AdvisedPlannerTest, FalseAdviceCostsARoundAtMost) {
  for (int i = 0; i < 40 && Summary()["rounds_without_certificate"] == 0; ++i) {
    AbstainOn(candidates_.back());
    advice_t advice = Advice();
    for (int c = 0; c < advice.num_changes; ++c) advice.change[c].value = 1e300;
    Say(advice);
    Run(30);
  }
  EXPECT_GE(Summary()["rounds_without_certificate"], 1);
  const std::size_t before = candidates_.size();
  Tell(Standing(8, 3.5, 7));
  ASSERT_EQ(candidates_.size(), before + 1) << "the next round begins anew";
  Certify();
  EXPECT_EQ(Summary()["certified"], 1);
}

struct RepairingPlannerTest : AdvisedPlannerTest {
  void SetUp() override {
    config_ = Bicycle();
    config_.planner.repairs = true;
    config_.planner.lead_steps = 20;
    config_.planner.candidates = 2;
    Start(config_);
    Tell(Standing());
    ASSERT_EQ(candidates_.size(), 1u);
  }

  // So far from the last candidate; told from others by the control of a step.
  advice_t Proposal(double nearness, double control) {
    advice_t advice{.changed = 4, .nearness = {nearness, nearness}};
    SetText(advice.source, PlannerNode::kSource);
    SetDigest(advice.plan_digest, PlanDigest(candidates_.back()));
    SetDigest(advice.obstacles_digest, ObstaclesDigest(config_.obstacles));
    advice.proposal = candidates_.back();
    advice.proposal.plan_id = advice.proposal.start_utime = 1;
    advice.proposal.initial_center[0] = 1e9;
    advice.proposal.progress_steps = 5;
    advice.proposal.control[3][1] = control;
    return advice;
  }
  void Refuse(const std::optional<advice_t>& advice) {
    AbstainOn(candidates_.back());
    if (advice) Say(*advice);
    Run(3);
  }
};

TEST_F(RepairingPlannerTest, SendsTheNearestProposalAfterItsOwnCandidates) {
  EXPECT_EQ(candidates_[0].repair, 1);
  Refuse(Proposal(0.2, 0.25));
  ASSERT_EQ(candidates_.size(), 2u) << "its own goes first";
  EXPECT_EQ(candidates_[1].repair, 1);
  EXPECT_NE(candidates_[1].control[3][1], 0.25);
  Refuse(Proposal(0.5, 0.125));
  ASSERT_EQ(candidates_.size(), 3u);
  const candidate_plan_t &sent = candidates_[2], &own = candidates_[1];
  EXPECT_EQ(sent.control[3][1], 0.25);
  EXPECT_EQ(std::tuple(sent.progress_steps, sent.num_steps, sent.repair), std::tuple(5, candidates_[0].num_steps, 0));
  EXPECT_EQ(std::tuple(sent.plan_id, sent.sequence), std::tuple(own.plan_id + 1, own.sequence + 1));
  EXPECT_EQ(sent.start_utime, own.start_utime);
  EXPECT_TRUE(std::ranges::equal(sent.initial_center, own.initial_center)) << "only controls are taken from a proposal";
  EXPECT_EQ(Summary()["repairs"], 1);
  Certify();
  EXPECT_THAT(Summary(), Holds({{"certified", 1}, {"rounds_without_certificate", 0}}));
}

TEST_F(RepairingPlannerTest, EndsItsRoundWhereTheProposalIsRefusedToo) {
  Refuse(Proposal(0.2, 0.25));
  Refuse(Proposal(0.1, 0.25));
  ASSERT_EQ(candidates_.size(), 3u);
  Refuse(std::nullopt);
  Run(30);
  EXPECT_EQ(candidates_.size(), 3u) << "of several, one is sent";
  EXPECT_EQ(Summary()["rounds_without_certificate"], 1);
}

TEST_F(RepairingPlannerTest, SendsNoneWhoseStartIsTooNear) {
  Refuse(Proposal(0.2, 0.25));
  AbstainOn(candidates_.back());
  const auto budget = static_cast<std::int64_t>(1000 * config_.gate.decision_budget_ms);
  now_ = candidates_[0].start_utime - budget + 1;
  Run(3);
  EXPECT_EQ(candidates_.size(), 2u);
  EXPECT_EQ(Summary()["rounds_without_certificate"], 1);
}

TEST_F(RepairingPlannerTest, SendsOneThatIsJustInTime) {
  Refuse(Proposal(0.2, 0.25));
  AbstainOn(candidates_.back());
  now_ = candidates_[0].start_utime - static_cast<std::int64_t>(1000 * config_.gate.decision_budget_ms) - 2000;
  Run(3);
  ASSERT_EQ(candidates_.size(), 3u);
  EXPECT_EQ(candidates_[2].control[3][1], 0.25);
}

TEST_F(RepairingPlannerTest, WaitsForTheAnswerThatNoneWasFoundAndNoLongerThanForAdvice) {
  AbstainOn(candidates_.back());
  Run(3);
  EXPECT_EQ(candidates_.size(), 1u) << "it waits";
  advice_t none = Proposal(0, 0);
  none.changed = 0;
  none.proposal = {};
  Say(none);
  Run(3);
  EXPECT_EQ(candidates_.size(), 2u);
  AbstainOn(candidates_.back());
  Run(static_cast<int>(2 * config_.gate.decision_budget_ms) + 3);
  EXPECT_EQ(candidates_.size(), 2u);
  EXPECT_EQ(Summary()["rounds_without_certificate"], 1);
}

// With no keys anybody can say this; with them, a certifier that is wrong.
TEST_F(RepairingPlannerTest, IgnoresAProposalThatIsNoneForItsCandidate) {
  const std::int64_t ignored = Summary()["messages_ignored"];
  Say(Proposal(0.1, 0.25));  // nothing was abstained on
  AbstainOn(candidates_.back());
  const auto say = [&](const auto& change) {
    advice_t wrong = Proposal(0.1, 0.25);
    change(wrong);
    Say(wrong);
  };
  say([](advice_t& advice) { advice.plan_digest[0] ^= 1; });
  say([](advice_t& advice) { advice.obstacles_digest[0] ^= 1; });
  for (const int steps : {-1, 0, 129, 32767})
    say([&](advice_t& advice) { advice.proposal.num_steps = static_cast<std::int16_t>(steps); });
  say([](advice_t& advice) { advice.proposal.progress_steps = -1; });
  say([](advice_t& advice) { ++(advice.proposal.progress_steps = advice.proposal.num_steps); });
  say([](advice_t& advice) { advice.proposal.num_inputs = 9; });
  say([](advice_t& advice) { advice.proposal.num_states = 5; });
  say([](advice_t& advice) { advice.nearness[0] = std::nan(""); });
  EXPECT_EQ(Summary()["messages_ignored"], ignored + 12);
  Run(static_cast<int>(2 * config_.gate.decision_budget_ms) + 3);
  ASSERT_EQ(candidates_.size(), 2u);
  Refuse(std::nullopt);
  Run(30);
  EXPECT_EQ(candidates_.size(), 2u);
}

TEST_F(PlannerNodeTest, AsksForNoRepairUnlessItsTaskSaysSo) {
  Tell(Standing());
  EXPECT_EQ(candidates_[0].repair, 0);
}

TEST_F(PlannerNodeTest, WaitsForNoAdviceUnlessItIsSent) {
  Tell(Standing());
  AbstainS();
  Run(2);
  EXPECT_EQ(candidates_.size(), 2u);
}

TEST_F(PlannerNodeTest, ProposesAgainAfterARejectionAndAfterAnAbstentionForTheDomain) {
  Tell(Standing());
  Tell(Decision(candidates_.back(), decision_t::REJECTED, decision_t::CAUSE_QUEUE_FULL));
  ASSERT_EQ(candidates_.size(), 2u);
  Tell(Decision(candidates_.back(), decision_t::ABSTAIN_DOMAIN, decision_t::CAUSE_DOMAIN_EXIT));
  EXPECT_EQ(candidates_.size(), 3u);
  EXPECT_EQ(Summary()["rejected"]["queue_full"], 1);
  EXPECT_EQ(Summary()["abstained"]["domain_exit"], 1);
}

TEST_F(PlannerNodeTest, GivesUpARoundWhoseDataAreFalsified) {
  Tell(Standing());
  Say(Decision(candidates_.back(), decision_t::ABSTAIN_FALSIFIED, decision_t::CAUSE_PAIRWISE));
  Run(20);
  EXPECT_EQ(candidates_.size(), 1u);
  EXPECT_EQ(Summary()["rounds_without_certificate"], 1);
}

TEST_F(PlannerNodeTest, StopsAfterSoManyCandidatesAndBeginsAnewWithTheNextState) {
  config_.planner.candidates = 3;
  Start(config_);
  Say(Standing());
  for (int i = 0; i < 5; ++i) {
    Run(3);
    if (i < 3) AbstainS();
  }
  EXPECT_EQ(candidates_.size(), 3u);
  EXPECT_EQ(Summary()["rounds_without_certificate"], 1);
  now_ = kNow + kPeriod;
  Tell(Standing());
  EXPECT_EQ(candidates_.size(), 4u);
}

// A robot that its laws do not bring to rest, or a declaration that allows too much.
TEST_F(PlannerNodeTest, SaysOnceWhereToLookWhenNoRoundHasACertificate) {
  config_.planner.candidates = 1;
  Start(config_);
  const auto lose = [&](int rounds) {
    testing::internal::CaptureStderr();
    for (int i = 0; i < rounds; ++i) {
      now_ += kPeriod;
      Tell(Standing());
      Say(Decision(candidates_.back(), decision_t::ABSTAIN_DOMAIN, decision_t::CAUSE_DOMAIN_EXIT));
      Run(3);
    }
    logging::Flush();
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_THAT(lose(PlannerNode::kLostRounds - 1), Not(HasSubstr("without a certificate")));
  EXPECT_THAT(lose(1),
              AllOf(HasSubstr("20 rounds in a row without a certificate; since the start 20 searches, 0 without "
                              "a plan, domain_exit 20"),
                    HasSubstr("forereach advise")));
  EXPECT_THAT(lose(30), Not(HasSubstr("without a certificate"))) << "it has been said";
}

struct StuckPlannerTest : PlannerNodeTest {
  void SetUp() override {
    config_ = Bicycle();
    config_.planner.candidates = 4;
    config_.planner.time_limit_ms = 4;  // before walls each search spends it all
    config_.laws.back_off = {{"(min(max((-0.4 - v)/0.6, -1.5), 0.85) - a)/dt"}, {"-delta/dt"}};
    Start(config_);
  }

  // Before walls at these x.
  void StartBefore(std::initializer_list<double> walls) {
    config_.obstacles.clear();
    for (const double x : walls) config_.obstacles.push_back(Obstacle::AxisBox(Vec({x, -15}), Vec({x + 0.5, 15})));
    Start(config_);
  }

  // Stands at x for so long, and has no candidate certified.
  void StandAt(double x, std::int64_t us) {
    for (const std::int64_t end = now_ + us; now_ < end; now_ += kPeriod - 12'000) {
      Tell(Standing(x, 0, sequence_++));
      for (int i = 0; i < 3; ++i) {
        if (!candidates_.empty() && candidates_.back().utime + 3000 >= now_) AbstainS();
        Run(3);
      }
    }
  }
  // The progress parts of the candidates that drive in reverse.
  std::vector<int> StepsBack() {
    std::vector<int> steps;
    for (const candidate_plan_t& plan : candidates_)
      if (Executing(plan, plan.num_steps).state[0] < plan.initial_center[0]) steps.push_back(plan.progress_steps);
    return steps;
  }

  std::int64_t sequence_ = 0;
};

TEST_F(StuckPlannerTest, ARobotThatDoesNotMoveBacksOffLessAfterEachRefusalAndThenFurther) {
  StartBefore({3, 12});
  StandAt(0, PlannerNode::kStuckUs);
  EXPECT_THAT(StepsBack(), IsEmpty());
  StandAt(0, 200'000);
  const int first = config_.planner.progress_steps;
  EXPECT_THAT(StepsBack(), ElementsAre(first, first / 2, first / 4));
  StandAt(0, PlannerNode::kStuckUs);
  EXPECT_THAT(StepsBack(), ElementsAre(first, first / 2, first / 4, 2 * first, first, first / 2))
      << "in between it searches";
  EXPECT_EQ(Summary()["back_off_rounds"], 2);
  StandAt(config_.planner.cruise_speed + 1, PlannerNode::kStuckUs + 200'000);
  ASSERT_EQ(StepsBack().size(), 9u);
  EXPECT_EQ(StepsBack()[6], first) << "another place";
}

TEST_F(StuckPlannerTest, ItBacksOffAsFarAsItTakesToDriveOn) {
  const double room = config_.planner.cruise_speed + config_.planner.clearance;  // what it keeps free beyond a plan
  StartBefore({room - 0.3});
  StandAt(0, PlannerNode::kStuckUs + 200'000);
  ASSERT_THAT(StepsBack(), Not(IsEmpty()));
  EXPECT_GT(StepsBack()[0], config_.planner.progress_steps);
  const auto first = std::ranges::find_if(
      candidates_, [&](const candidate_plan_t& plan) { return plan.progress_steps == StepsBack()[0]; });
  const double ends_at = Executing(*first, first->num_steps).state[0];
  EXPECT_LT(ends_at, -0.3);
  EXPECT_GT(ends_at, -0.3 - 0.4 * 0.1 * config_.planner.progress_steps) << "and no further";
}

TEST_F(StuckPlannerTest, WhereItHasRoomToDriveOnItWaitsLongerForWhatMoves) {
  StandAt(0, PlannerNode::kWaitsUs);
  EXPECT_THAT(StepsBack(), IsEmpty());
  StandAt(0, 200'000);
  EXPECT_THAT(StepsBack(), Not(IsEmpty()));
}

TEST_F(StuckPlannerTest, ARobotThatHasBegunToDriveDoesNotBackOff) {
  StandAt(0, PlannerNode::kWaitsUs - 200'000);
  Tell(Standing(0, 0, sequence_++));
  Certify();
  const candidate_plan_t plan = candidates_.back();
  now_ = plan.start_utime + DueStep(plan) * kPeriod;
  robot_state_t state = Executing(plan, DueStep(plan));
  state.sequence = sequence_++;
  const std::size_t before = candidates_.size();
  Tell(state);
  EXPECT_GT(candidates_.size(), before);
  EXPECT_THAT(StepsBack(), IsEmpty());
}

TEST_F(StuckPlannerTest, WithoutALawItStaysWhereItIs) {
  config_.laws.back_off.clear();
  Start(config_);
  StandAt(0, 2 * PlannerNode::kStuckUs);
  EXPECT_THAT(StepsBack(), IsEmpty());
  EXPECT_GT(candidates_.size(), 20u);
}

TEST_F(StuckPlannerTest, ARobotThatMovesIsNotStuck) {
  for (int i = 0; i < 8; ++i) StandAt(i, PlannerNode::kStuckUs / 2);
  EXPECT_THAT(StepsBack(), IsEmpty());
}

TEST_F(PlannerNodeTest, SendsNothingThatWouldComeTooLate) {
  robot_state_t state = Standing();
  Say(state);
  const auto search_us = static_cast<std::int64_t>(config_.planner.time_limit_ms * 1e3);
  now_ = state.utime + config_.planner.lead_steps * kPeriod - search_us;
  Run(3);
  EXPECT_TRUE(candidates_.empty());
  EXPECT_EQ(Summary()["rounds_without_certificate"], 1);
}

TEST_F(PlannerNodeTest, WaitsForTheStartOfACertifiedPlan) {
  const robot_state_t state = Standing();
  Tell(state);
  Certify();
  Run(37);
  Say(Standing());  // the boundary before the start
  Run(20);
  EXPECT_EQ(candidates_.size(), 1u);
}

TEST_F(PlannerNodeTest, PlansTheHandoverInTimeForTheTail) {
  Tell(Standing());
  Certify();
  const candidate_plan_t first = candidates_[0];
  for (int step = 0; step < DueStep(first); ++step) {
    ReachStep(first, step);
    ASSERT_EQ(candidates_.size(), 1u) << "step " << step;
  }
  ReachStep(first, DueStep(first));
  ASSERT_EQ(candidates_.size(), 2u);
  EXPECT_EQ(candidates_[1].start_utime, first.start_utime + first.progress_steps * kPeriod);
  const robot_state_t expected = Executing(first, first.progress_steps);  // the residual of this task is zero
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(candidates_[1].initial_center[k], expected.state[k], 1e-12);
}

TEST_F(PlannerNodeTest, PredictsThatARobotStandsAfterItsTail) {
  Tell(Standing());
  Certify();
  const candidate_plan_t first = candidates_[0];
  ReachStep(first, first.num_steps - 1);
  ASSERT_EQ(candidates_.size(), 2u);
  EXPECT_FIELDS(candidates_[1], (initial_center[3], 0), (initial_center[4], 0));
  EXPECT_NEAR(candidates_[1].initial_center[0], Executing(first, first.num_steps).state[0], 1e-9);
}

TEST_F(PlannerNodeTest, PlansAgainIfTheRobotDidNotStartACertifiedPlan) {
  Tell(Standing());
  Certify();
  now_ = candidates_[0].start_utime;
  Tell(Standing());
  EXPECT_EQ(candidates_.size(), 2u);
}

TEST_F(PlannerNodeTest, GivesUpWaitingForADecisionAtTheStart) {
  const robot_state_t state = Standing();
  Tell(state);
  now_ = candidates_[0].start_utime;
  Tell(Standing());
  EXPECT_EQ(candidates_.size(), 2u);
  EXPECT_EQ(Summary()["unanswered"], 1);
}

TEST_F(PlannerNodeTest, LeavesAPlanThatItDidNotSendAlone) {
  Say(Executing(candidate_plan_t{.plan_id = 5, .num_steps = 20}, 10));
  Run(10);
  EXPECT_TRUE(candidates_.empty());
}

TEST_F(PlannerNodeTest, IgnoresDecisionsThatConcernSomebodyElse) {
  Tell(Standing());
  decision_t decision = Decision(candidates_[0], decision_t::CERTIFIED, decision_t::CAUSE_NONE);
  SetText(decision.source, "another planner");
  Say(decision);
  decision = Decision(candidates_[0], decision_t::CERTIFIED, decision_t::CAUSE_NONE);
  ++decision.plan_id;
  Say(decision);
  EXPECT_THAT(Summary(), Holds({{"certified", 0}, {"messages_ignored", 2}}));
  AbstainS();
  AbstainS();  // twice: the second concerns nothing that is awaited
  EXPECT_EQ(Summary()["abstained"]["obstacle"], 1);
  EXPECT_EQ(Summary()["messages_ignored"], 3);
}

TEST_F(PlannerNodeTest, SurvivesBadMessagesAndThenWorks) {
  const std::vector<std::uint8_t> good = Encode(Standing());
  std::vector<std::uint8_t> shorter(good.begin(), good.end() - 1), longer = good, other = good;
  longer.push_back(0);
  other[0] ^= 1;
  for (const auto& bytes : {std::vector<std::uint8_t>{}, shorter, longer, other})
    for (const std::string& channel : {config_.bus.robot_state, config_.bus.decision, config_.bus.obstacles})
      ASSERT_TRUE(bus_->Publish(channel, Bytes(bytes)));
  Deliver();
  Run(10);
  for (const double value : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    robot_state_t state = Standing();
    state.state[3] = value;
    Say(state);
  }
  robot_state_t state = Standing();
  state.num_states = 4;
  Say(state);
  state = Standing();
  state.mode = 7;
  Say(state);
  Run(10);
  EXPECT_TRUE(candidates_.empty());
  EXPECT_EQ(Summary()["messages_ignored"], 16);
  Tell(Standing());
  EXPECT_EQ(candidates_.size(), 1u);
}

TEST_F(PlannerNodeTest, AStateIsUsedOnce) {
  const robot_state_t state = Standing();
  Tell(state);
  Certify();
  Say(state);
  EXPECT_EQ(Summary()["messages_ignored"], 1);
}

TEST_F(PlannerNodeTest, AStateThatComesLateIsIgnored) {
  const auto say = [&](std::int64_t sequence, std::int64_t stamp) {
    robot_state_t state = Standing();
    state.sequence = sequence;
    state.utime = now_ + stamp;
    Say(state);
    return Summary()["messages_ignored"].get<int>();
  };
  EXPECT_EQ(say(5, -100), 0);
  EXPECT_EQ(say(4, -200), 1) << "overtaken";
  EXPECT_EQ(say(0, -200), 2) << "an older stamp never replaces a newer one";
  EXPECT_EQ(say(6, -300), 2) << "the robot's clock was set back, its count goes on";
  EXPECT_EQ(say(0, -50), 2) << "the robot restarted";
}

TEST_F(PlannerNodeTest, AStateFromTheFutureDoesNotKeepOutThoseOfNow) {
  robot_state_t state = Standing();
  state.utime = now_ + 50'001;  // gate.max_ahead_ms is 50
  Tell(state);
  EXPECT_TRUE(candidates_.empty());
  EXPECT_EQ(Summary()["messages_ignored"], 1);
  Tell(Standing());
  EXPECT_EQ(candidates_.size(), 1u);
}

TEST_F(PlannerNodeTest, PlansOnlyWhileTheObstaclesOnTheBusAreKnown) {
  StartOnTheBus();
  std::int64_t sequence = 0;
  const auto see = [&] { Say(Sighted({Obstacle::Circle(Vec({12, 0}), 2)}, now_, sequence++)); };
  const auto round = [&] { Tell(Standing()); };
  round();
  EXPECT_TRUE(candidates_.empty()) << "none has been heard";
  see();
  round();
  EXPECT_GT(Clearance(Only(candidates_)), config_.planner.clearance);
  Run(1001);
  round();
  EXPECT_EQ(candidates_.size(), 1u) << "they have fallen silent";
  see();
  round();
  EXPECT_EQ(candidates_.size(), 2u);
  ++sequence;  // one is lost
  see();
  Run(200);
  round();
  EXPECT_EQ(candidates_.size(), 2u);
}

TEST_F(PlannerNodeTest, EndsTheRoundWhereTheCertifierDoesNotKnowTheObstacles) {
  Tell(Standing());
  decision_t decision{.plan_id = Only(candidates_).plan_id};
  SetText(decision.source, PlannerNode::kSource);
  decision.outcome = decision_t::ABSTAIN_OBSTACLES;
  decision.cause = decision_t::CAUSE_NO_OBSTACLES;
  Say(decision);
  Run(20);
  EXPECT_EQ(candidates_.size(), 1u) << "no other candidate before the next state";
  EXPECT_EQ(Summary()["abstained"], nlohmann::json({{"no_obstacles", 1}}));
}

// As the gate does: else the planner would go on around the obstacles of before, and the gate refuse what it finds.
TEST_F(PlannerNodeTest, HearsAPublisherOfObstaclesThatBeganAnew) {
  StartOnTheBus();
  obstacles_t message = Sighted({Obstacle::Circle(Vec({12, 0}), 2)}, now_, 7);
  Say(message);
  Say(message);  // a repetition: ignored
  message.sequence = 0;
  message.utime = now_ + 50'001;  // gate.max_ahead_ms is 50: ignored
  Say(message);
  message.utime = now_ + 1;
  Say(message);
  EXPECT_EQ(Summary()["messages_ignored"], 2);
}

TEST_F(PlannerNodeTest, PlansAroundTheObstaclesItIsTold) {
  StartOnTheBus(10'000);
  config_.obstacles = {Obstacle::Circle(Vec({12, 0}), 2)};
  obstacles_t message = Sighted(config_.obstacles, now_, 1);
  message.num_obstacles = 65;
  Say(message);  // cannot be: ignored
  message.num_obstacles = 1;
  Say(message);
  EXPECT_EQ(Summary()["messages_ignored"], 1);
  robot_state_t state = Standing();
  for (int plan = 0; plan < 8; ++plan) {
    Tell(state);
    ASSERT_EQ(candidates_.size(), static_cast<std::size_t>(plan + 1));
    EXPECT_GT(Clearance(candidates_.back()), config_.planner.clearance);
    Certify();
    now_ = candidates_.back().start_utime + DueStep(candidates_.back()) * kPeriod;
    state = Executing(candidates_.back(), DueStep(candidates_.back()));
  }
}

TEST_F(PlannerNodeTest, SendsNothingOnceTheRobotHasFinished) {
  Tell(Standing());
  now_ += 1000;
  robot_state_t finished = Standing();
  finished.mode = robot_state_t::FINISHED;
  Say(finished);
  EXPECT_TRUE(node_->done());
  AbstainS();
  now_ += kPeriod;
  Say(Standing());
  Run(100);
  EXPECT_EQ(candidates_.size(), 1u);
}

TEST_F(PlannerNodeTest, SendsNothingAtTheGoal) {
  Say(Standing(64));
  Run(20);
  EXPECT_TRUE(candidates_.empty());
  EXPECT_FALSE(node_->done());
}

TEST_F(PlannerNodeTest, TheSameMessagesGetTheSameCandidates) {
  const auto run = [this] {
    now_ = kNow;
    candidates_.clear();
    Start(Bicycle());
    Say(Standing());
    for (int i = 0; i < 4; ++i) {
      Run(3);
      AbstainS();
    }
    std::vector<std::vector<std::uint8_t>> bytes;
    for (const candidate_plan_t& candidate : candidates_) bytes.push_back(Encode(candidate));
    return bytes;
  };
  const auto first = run();
  EXPECT_EQ(first.size(), 4u);
  EXPECT_EQ(first, run());
}

struct WithdrawnPlanTest : PlannerNodeTest {
  // The robot executes the first candidate, at this step.
  void Execute(int step) {
    Tell(Standing());
    Certify();
    ReachStep(candidates_[0], step);
    ASSERT_EQ(candidates_.size(), 1u) << "no other is due";
  }
  void Withdraw(int valid_steps, std::size_t which = 0) {
    withdrawal_t withdrawal{.utime = now_, .sequence = sequence_++, .plan_id = candidates_[which].plan_id};
    withdrawal.valid_steps = static_cast<std::int16_t>(valid_steps);
    std::ranges::copy(candidates_[which].source, withdrawal.source);
    Publish(config_.bus.withdrawn, withdrawal);
  }

  std::int64_t sequence_ = 0;
};

TEST_F(WithdrawnPlanTest, AStopIsProposedAtOnceFromTheNextHandover) {
  Execute(3);
  Withdraw(6);
  Run(1);
  ASSERT_EQ(candidates_.size(), 2u);
  const candidate_plan_t& stop = candidates_[1];
  EXPECT_FIELDS(stop, (start_utime, candidates_[0].start_utime + 4 * kPeriod), (progress_steps, 0));
  const robot_state_t begin = Executing(candidates_[0], 4), end = Executing(stop, stop.num_steps);
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(stop.initial_center[k], begin.state[k], 1e-12);
  EXPECT_NEAR(end.state[3], 0, 1e-9);
  EXPECT_NEAR(end.state[4], 0, 1e-9);
  for (int t = 0; t < stop.num_steps; ++t) EXPECT_EQ(stop.control[t][1], 0) << "the steering is held";
  EXPECT_THAT(Summary(), Holds({{"withdrawn", 1}, {"stopping_rounds", 1}}));
}

TEST_F(WithdrawnPlanTest, OtherStopsAreProposedAfterAnAbstention) {
  Execute(3);
  Withdraw(6);
  Run(1);
  for (std::size_t count = 2; count <= 5; ++count) {
    ASSERT_EQ(candidates_.size(), count);
    AbstainS();
    Run(1);
  }
  EXPECT_EQ(candidates_.size(), 5u) << "there are four ways";
  std::set<std::vector<double>> steering;
  for (std::size_t i = 1; i < candidates_.size(); ++i) {
    auto& rates = candidates_[i].control;
    std::vector<double> its;
    for (int t = 0; t < candidates_[i].num_steps; ++t) its.push_back(rates[t][1]);
    steering.insert(its);
  }
  EXPECT_GE(steering.size(), 3u) << "held, to the left, to the right";
}

TEST_F(WithdrawnPlanTest, NoStopIsProposedAfterTheLastStepThatStands) {
  Execute(3);
  Withdraw(3);
  Run(3);
  EXPECT_EQ(candidates_.size(), 1u);
  Withdraw(4);
  Run(3);
  EXPECT_EQ(candidates_.size(), 1u) << "what was withdrawn does not stand again";
}

TEST_F(WithdrawnPlanTest, AStopIsProposedAtTheLastBoundaryThatStands) {
  Execute(3);
  Withdraw(4);
  Run(1);
  EXPECT_EQ(candidates_.size(), 2u);
}

TEST_F(WithdrawnPlanTest, ARepeatedWithdrawalStartsNoNewRound) {
  Execute(3);
  Withdraw(6);
  Run(1);
  Certify();
  Withdraw(6);
  Withdraw(6);
  Run(3);
  EXPECT_EQ(candidates_.size(), 2u);
  EXPECT_EQ(Summary()["withdrawn"], 1);
}

TEST_F(WithdrawnPlanTest, ARoundUnderWayGivesWayToTheStop) {
  Execute(3);
  const int due = DueStep(candidates_[0]);
  ReachStep(candidates_[0], due);
  ASSERT_EQ(candidates_.size(), 2u);
  Withdraw(due + 2);
  Run(1);
  ASSERT_EQ(candidates_.size(), 3u);
  EXPECT_EQ(candidates_[2].progress_steps, 0);
}

TEST_F(WithdrawnPlanTest, NoStopIsProposedWhereACertifiedPlanTakesOverInTime) {
  Execute(3);
  const int due = DueStep(candidates_[0]);
  ReachStep(candidates_[0], due);
  Certify();
  Withdraw(due + config_.planner.lead_steps);
  Run(3);
  EXPECT_EQ(candidates_.size(), 2u);
  Withdraw(due + config_.planner.lead_steps - 1);
  Run(3);
  EXPECT_EQ(candidates_.size(), 3u) << "now it comes too late";
}

TEST_F(WithdrawnPlanTest, AWithdrawnPlanThatHasNotBegunIsReplaced) {
  Tell(Standing());
  Certify();
  Withdraw(0);
  Run(3);
  EXPECT_EQ(candidates_.size(), 1u) << "it needs a state to begin from";
  now_ += kPeriod;
  Tell(Standing());
  EXPECT_EQ(candidates_.size(), 2u);
}

TEST_F(WithdrawnPlanTest, WithdrawalsOfOthersAreIgnored) {
  Execute(3);
  withdrawal_t withdrawal{.plan_id = candidates_[0].plan_id};
  SetText(withdrawal.source, "another");
  Publish(config_.bus.withdrawn, withdrawal);
  Publish(config_.bus.withdrawn, Bytes(std::vector<std::uint8_t>{1, 2, 3}));
  Run(3);
  EXPECT_EQ(candidates_.size(), 1u);
  EXPECT_EQ(Summary()["messages_ignored"], 2);
}

TEST_F(PlannerNodeTest, WorksForThePointMassToo) {
  Start(PointMass());
  robot_state_t state = Standing();
  state.num_states = 4;
  Tell(state);
  EXPECT_EQ(Only(candidates_).num_states, 4);
}

TEST_F(PlannerNodeTest, StopPrintsTheCounts) {
  Tell(Standing());
  AbstainS();
  Run(3);
  Certify();
  node_->Stop();
  const auto summary = nlohmann::json::parse(out_.str());
  EXPECT_THAT(summary, Holds({{"proposed", 2}, {"certified", 1}, {"rounds", 1}, {"rounds_without_certificate", 0}}));
  EXPECT_THAT(summary, Holds({{"abstained", {{"obstacle", 1}}}, {"rejected", nlohmann::json::object()}}));
}

TEST(PlannerNode, RefusesATaskThatDoesNotFit) {
  const auto bus = OpenBus("memq://");
  Config config = Bicycle();
  config.planner.initial_half_width = {1, 2};
  EXPECT_THROW(PlannerNode(config, *bus), ConfigError);
  config = Bicycle();
  config.planner.goal = {};
  EXPECT_THROW(PlannerNode(config, *bus), ConfigError);
}

}  // namespace forereach::planner_node_test
