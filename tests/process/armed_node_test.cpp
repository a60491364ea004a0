// Arming, faults, learning and shadow mode of the certifier's node.
#include "tests/test.h"

#include "clients/supervised.h"
#include "forereach/dynamics/models/named_residuals.h"
#include "simulator/sim_node.h"
#include "tests/process/certifier_node_fixture.h"

namespace forereach::armed_node_test {

// By what it claims no state would be outside its slice.
TEST_F(ArmedNodeTest, AStateWithALargerErrorThanDeclaredIsNotTakenForKnown) {
  Own(config_.problem).declaration.state_error = Eigen::Vector4d(0.25, 0, 0, 0);
  Restart();
  const auto with_error = [&](int k, double error) {
    robot_state_t state = State();
    state.num_state_errors = 4;
    state.state_error[k] = error;
    return state;
  };
  SayState(with_error(0, std::nextafter(0.25, 1)));
  EXPECT_EQ(node_->watch().state(), Watch::State::kDisarmed);
  SayState(with_error(0, 0.25));
  EXPECT_EQ(node_->watch().state(), Watch::State::kArmed);
  EXPECT_EQ(node_->gate().CheckRobotState(with_error(2, 1e-9), now_us_),
            "the error of vx is 1e-09, and declaration.state_error is 0");
}

TEST_F(ArmedNodeTest, CertifiesNothingBeforeItHasHeardTheRobot) {
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
  EXPECT_EQ(status_.back().level, certifier_status_t::STALE);
  robot_state_t bad = State();
  bad.state[1] = std::numeric_limits<double>::quiet_NaN();
  SayState(bad);
  bad = State();
  bad.num_states = 5;
  SayState(bad);
  bad = State();
  bad.utime -= 1'000'000;
  SayState(bad);
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED) << "what is no state arms nothing";
  SayState(State());
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  EXPECT_EQ(certified_.size(), 1u);
}

TEST_F(ArmedNodeTest, OneThatWasStoppedSaysSoInTheFaultThatItLatches) {
  SayState(State());
  for (int i = 0; i < 17; ++i) {
    Pass(5'000);
    Run();
  }
  Pass(1'830'000);
  const decision_t decision = Ask();
  ASSERT_EQ(faults_.size(), 1u) << "it stays a fault";
  EXPECT_EQ(faults_[0].cause, fault_t::ROBOT_STATE_LOST);
  const std::string why =
      "the robot's state was last heard 1915 ms ago, at most 1000 ms are allowed: this certifier itself did not run "
      "for "
      "1830 ms";
  EXPECT_EQ(GetText(faults_[0].message), why);
  EXPECT_EQ(decision.cause, decision_t::CAUSE_FAULT);
  EXPECT_EQ(GetText(decision.message), "rejected: fault: " + why);
  EXPECT_EQ(GetText(status_.back().message), "robot_state_lost: " + why);
}

TEST_F(ArmedNodeTest, LosingTheRobotLatchesUntilAReset) {
  SayState(State());
  Pass(1'000'000);
  Run();
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED) << "just in time";
  Pass(1);
  Run();
  EXPECT_EQ(Only(faults_).cause, fault_t::ROBOT_STATE_LOST);
  SayState(State());
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_FAULT) << "that it is back does not clear it";
  EXPECT_EQ(status_.back().level, certifier_status_t::ERROR);
  Reset();
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
  SayState(State());
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
}

TEST_F(ArmedNodeTest, AResetFromBeforeTheFaultClearsNothing) {
  SayState(State());
  Pass(1'000'001);
  Run();
  ASSERT_EQ(faults_.size(), 1u);
  Pass(10'000);
  for (const std::int64_t utime : {faults_[0].utime - 1, faults_[0].utime}) {
    Reset(utime);
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_FAULT) << "it was meant for another";
  }
  Reset(faults_[0].utime + 1);
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
}

TEST_F(ArmedNodeTest, AfterTheClockWasSetBackAResetNeedNotWaitForTheFaultsTime) {
  std::int64_t steady = 0;
  const auto node = std::make_unique<CertifierNode>(config_, *bus_, Clocks{clock_, [&] { return steady; }});
  node->Tick(now_us_);
  now_us_ += 3'600'000'000;
  node->Tick(now_us_);
  ASSERT_TRUE(node->watch().fault());
  now_us_ -= 3'600'000'000;
  node->Tick(now_us_);
  ASSERT_GT(node->watch().fault()->utime, now_us_);
  Reset();
  EXPECT_FALSE(node->watch().fault());
}

TEST_F(ArmedNodeTest, ARobotThatHasFinishedIsNotLost) {
  SayState(State());
  robot_state_t last = State();
  last.mode = robot_state_t::FINISHED;
  SayState(last);
  Pass(5'000'000);
  Run();
  EXPECT_TRUE(faults_.empty());
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
}

TEST_F(ArmedNodeTest, AClockThatJumpsLatches) {
  std::int64_t steady = 0;
  node_ = nullptr;
  bus_ = OpenBus("memq://", clock_);
  CertifierNode node(config_, *bus_, {clock_, [&] { return steady; }});
  for (const std::int64_t jump : {200'000, 200'001}) {
    node.Tick(now_us_);
    now_us_ += 2000 + jump;
    steady += 2000;
    node.Tick(now_us_);
    EXPECT_EQ(node.watch().fault().has_value(), jump > 200'000) << jump;
  }
  EXPECT_EQ(node.watch().fault()->cause, fault_t::CLOCK_JUMP);
}

TEST_F(ArmedNodeTest, HeartbeatsGoOnWhereTheClockJumpsToAndFro) {
  std::int64_t steady = 0;
  node_ = nullptr;
  bus_ = OpenBus("memq://", clock_);
  int heartbeats = 0;
  bus_->Subscribe("CERTIFIER_STATUS", [&](const Received&) { ++heartbeats; });
  CertifierNode node(config_, *bus_, {clock_, [&] { return steady; }});
  constexpr std::int64_t kHour = 3'600'000'000, kStep = CertifierNode::kHeartbeatUs;
  for (const std::int64_t jump : {std::int64_t{0}, kHour, -kHour, -kHour}) {
    now_us_ += jump;
    heartbeats = 0;
    for (int i = 0; i < 4; ++i) {
      now_us_ += kStep;
      steady += kStep;
      node.Tick(now_us_);
      bus_->Dispatch(0);
    }
    EXPECT_EQ(heartbeats, 4) << "after a jump of " << jump;
  }
}

TEST_F(ArmedNodeTest, AStateOutsideItsSliceLatchesAndNamesTheTransition) {
  SayState(State());
  ASSERT_EQ(Ask().outcome, decision_t::CERTIFIED);
  const certified_plan_t plan = certified_.back();
  for (const bool outside : {false, true}) {
    robot_state_t state = AtUpperBound(plan, 1);
    if (outside) state.state[2] = std::nextafter(state.state[2], 10.0);
    bus_->Publish("TRANSITION", transition_t{.utime = 77});
    SayState(state);
    ASSERT_EQ(faults_.size(), outside ? 1u : 0u);
  }
  EXPECT_FIELDS(faults_[0], (cause, fault_t::SLICE_LEFT), (plan_id, plan.plan.plan_id), (step, 1), (coordinate, 2),
                (upper, plan.slice_upper[1][2]), (transition.utime, 77));
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_FAULT);
}

// A robot that is not what its task says: its guard stops it, and the certifier has seen it too.
TEST_F(ArmedNodeTest, ARobotThatLeavesItsSliceLatches) {
  config_.gate.learns = false;  // else the first step falsifies the declaration
  config_.robot.start = {0, 0, 1, 0.1};
  config_.robot.step_period_ms = 150;
  ResidualText drag = ResidualNamed("velocity_knee");
  for (auto& [name, lower, upper] : drag.parameters)
    lower = upper = name == "damping" ? 4 : name == "knee" ? 0.1 : lower;
  config_.robot_residual = ResidualOf(*config_.problem->model, drag);
  Restart();
  robot_state_t last_state{};
  Hear(*bus_, "ROBOT_STATE", last_state);
  std::ostringstream summary;
  RobotSimNode robot(config_, *bus_, summary);
  const auto run_for = [&](std::int64_t us) {
    for (const std::int64_t end = now_us_ + us; now_us_ < end; Pass(2000)) {
      robot.Tick(now_us_);
      Run();
    }
  };
  run_for(10'000);
  bus_->Publish("PLAN_CANDIDATE", Candidate(1, kAccelerationThatCertifies, now_us_));
  run_for(2'000'000);
  ASSERT_EQ(certified_.size(), 1u);
  ASSERT_FALSE(faults_.empty());
  EXPECT_FIELDS(faults_[0], (cause, fault_t::SLICE_LEFT), (plan_id, 1), (step, faults_[0].state.executing_step + 1),
                (value, faults_[0].transition.next_state[faults_[0].coordinate]));
  EXPECT_EQ(last_state.mode, robot_state_t::STANDING);
  EXPECT_GT(faults_.size(), 1u) << "said again with the heartbeats";
  for (const fault_t& fault : faults_) EXPECT_EQ(Encode(fault), Encode(faults_[0]));
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_FAULT);
  const std::size_t said = faults_.size();
  Reset();
  run_for(2'000'000);
  EXPECT_EQ(faults_.size(), said);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
}

// The small task's certificates live 2 s; a message may be 0.5 s old, twice; 128 steps take 0.15 s each.
constexpr std::int64_t kTolerated = 2'000'000 + 1'000'000 + 128 * 150'000;

struct StrangerTest : ArmedNodeTest {
  // Says twice a second that it stands, so that it is not lost.
  void StandFor(std::int64_t us) {
    for (const std::int64_t end = now_us_ + us; now_us_ < end;) {
      Pass(std::min<std::int64_t>(500'000, end - now_us_));
      SayState(State());
    }
  }
};

TEST_F(StrangerTest, LatchesOnAnUnknownPlanOnceEarlierCertifiersPlansHaveEnded) {
  SayState(State());
  StandFor(kTolerated);
  SayState(State(7, 3));
  EXPECT_TRUE(faults_.empty()) << "the certifier before this may have certified it";
  Pass(1);
  SayState(State(7, 3));
  EXPECT_FIELDS(Only(faults_), (cause, fault_t::UNCERTIFIED_PLAN), (plan_id, 7), (step, 3));
  EXPECT_EQ(GetText(faults_[0].message), "the robot executes plan 7, which was not certified, or should have ended");
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_FAULT);
  Reset();
  SayState(State(7, 4));
  EXPECT_EQ(faults_.back().sequence, 1) << "it still does";
}

TEST_F(StrangerTest, LatchesWhenItsOwnPlanRunsBeyondItsEnd) {
  SayState(State());
  StandFor(kTolerated + 1);
  ASSERT_EQ(Ask().outcome, decision_t::CERTIFIED);
  const certified_plan_t plan = certified_.back();
  for (const int step : {0, 5, 9}) {
    Pass(1000);
    SayState(AtUpperBound(plan, step));
  }
  EXPECT_TRUE(faults_.empty());
  SayState(AtUpperBound(plan, 10));
  ASSERT_EQ(faults_.size(), 1u) << "it has controls 0 to 9";
  EXPECT_EQ(faults_[0].cause, fault_t::UNCERTIFIED_PLAN);
  EXPECT_THAT(GetText(faults_[0].message), HasSubstr("step 10 of 10"));
  Reset();
  SayState(AtUpperBound(plan, -1));
  EXPECT_EQ(faults_.back().sequence, 1);
}

TEST_F(StrangerTest, LatchesWhenAnAbstainedCandidateIsExecuted) {
  SayState(State());
  StandFor(kTolerated + 1);
  ASSERT_EQ(Ask(kAccelerationIntoTheCircle).outcome, decision_t::ABSTAIN_SAFETY);
  SayState(State(decisions_.back().plan_id, 0));
  EXPECT_EQ(Only(faults_).cause, fault_t::UNCERTIFIED_PLAN);
}

// A certifier in shadow mode looks on while something else decides.
TEST_F(StrangerTest, ShadowModeDoesNotLatchOnAnUnknownPlan) {
  config_.gate.shadow = true;
  Restart();
  SayState(State());
  StandFor(kTolerated + 1);
  SayState(State(7, 3));
  EXPECT_TRUE(faults_.empty());
}

const Eigen::VectorXd kStep = Vec({1, 1, 0.5, 0.5, 0, 0});

TEST_F(ArmedNodeTest, ExecutedTransitionsAddToTheObservationsAndChangeTheirDigest) {
  SayState(State());
  const Digest before = GetDigest(Ask().observations_digest);
  const transition_t transition = Executed(*config_.problem->model, kStep);
  bus_->Publish("TRANSITION", transition);
  Run();
  EXPECT_EQ(node_->gate().certifier().num_observations(), 3u);
  const decision_t after = Ask();
  EXPECT_EQ(after.outcome, decision_t::CERTIFIED);
  EXPECT_EQ(GetDigest(after.observations_digest), ChainedDigest(before, Encode(transition)));
  bus_->Publish("TRANSITION", Executed(*config_.problem->model, kStep * 100));
  Run();
  EXPECT_EQ(node_->gate().certifier().num_observations(), 3u) << "outside the domain it says nothing";
}

TEST_F(ArmedNodeTest, ATransitionThatContradictsTheDeclarationFalsifiesItForGood) {
  SayState(State());
  ASSERT_EQ(Ask().outcome, decision_t::CERTIFIED);
  bus_->Publish("TRANSITION", Executed(*config_.problem->model, kStep, 0.01));
  Run();
  EXPECT_FIELDS(Only(faults_), (cause, fault_t::DECLARATION_FALSIFIED), (second_observation, 2),
                (transition.next_state[2], Executed(*config_.problem->model, kStep, 0.01).next_state[2]));
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_FAULT);
  Reset();
  SayState(State());
  EXPECT_EQ(Ask().outcome, decision_t::ABSTAIN_FALSIFIED) << "F from then on, whoever resets";
}

// A robot goes on where only the certifier has lost sight of it. What it rests on has to stop it all the same.
TEST_F(ArmedNodeTest, AFaultThatStopsTheRobotTakesThePlaceOfOneThatDoesNot) {
  for (const bool lost_first : {true, false}) {
    Restart();
    faults_.clear();
    SayState(State());
    const auto lose_robot = [&] {
      Pass(1'000'001);
      Run();
    };
    if (lost_first) lose_robot();
    bus_->Publish("TRANSITION", Executed(*config_.problem->model, kStep, 0.01));
    Run();
    if (!lost_first) lose_robot();
    EXPECT_EQ(faults_.front().cause, lost_first ? fault_t::ROBOT_STATE_LOST : fault_t::DECLARATION_FALSIFIED);
    EXPECT_EQ(faults_.back().cause, fault_t::DECLARATION_FALSIFIED);
    EXPECT_EQ(faults_.back().sequence, lost_first ? 1 : 0);
    EXPECT_EQ(status_.back().fault, fault_t::DECLARATION_FALSIFIED);
  }
}

TEST_F(ArmedNodeTest, IndexesManyTransitionsWhileItRuns) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-2, 2);
  for (int i = 0; i < 1000; ++i) {
    Eigen::VectorXd z(6);
    for (double& x : z) x = anywhere(random);
    bus_->Publish("TRANSITION", Executed(*config_.problem->model, z));
    Run();
  }
  EXPECT_EQ(node_->gate().certifier().num_observations(), 1002u);
  EXPECT_LT(node_->gate().certifier().num_unindexed(), 128);
  SayState(State());
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
}

TEST_F(ArmedNodeTest, ATaskThatDoesNotLearnIgnoresTransitions) {
  config_.gate.learns = false;
  Restart();
  bus_->Publish("TRANSITION", Executed(*config_.problem->model, Eigen::VectorXd::Zero(6), 0.01));
  SayState(State());
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
}

TEST_F(ArmedNodeTest, ShadowModeSaysWhatItWouldDoAndPassesNothingOn) {
  config_.gate.shadow = true;
  Restart();
  SayState(State());
  const decision_t decision = Ask();
  EXPECT_FIELDS(decision, (outcome, decision_t::REJECTED), (cause, decision_t::CAUSE_SHADOW));
  EXPECT_GT(decision.margin, decision.threshold);
  EXPECT_EQ(Ask(kAccelerationIntoTheCircle).outcome, decision_t::ABSTAIN_SAFETY);
  EXPECT_TRUE(certified_.empty());
}

TEST_F(ArmedNodeTest, NothingThatAShadowSendsIsTakenByAGuardNowOrOnceTheTaskCertifies) {
  std::vector<std::vector<std::uint8_t>> sent;
  config_.robot.step_period_ms = 150;
  Guard guard(SupervisorOptionsOf(config_).guard);
  for (const bool shadow : {true, false}) {
    config_.gate.shadow = shadow;
    Restart();
    bus_->Subscribe(Bus::kEveryChannel, [&](const Received& r) { sent.emplace_back(r.raw.begin(), r.raw.end()); });
    SayState(State());
    for (int i = 0; i < 3; ++i) EXPECT_EQ(Ask().outcome, shadow ? decision_t::REJECTED : decision_t::CERTIFIED);
    now_us_ += CertifierNode::kHeartbeatUs;
    Run();
    EXPECT_EQ(status_.back().shadow, shadow);
    EXPECT_EQ(GetText(status_.back().message).starts_with("SHADOW"), shadow);
    int taken = 0;
    std::string why;
    for (const auto& bytes : sent) {
      const GuardVerdict verdict = guard.Accept(bytes, now_us_);
      taken += verdict.ok() ? 1 : 0;
      if (bytes.size() == EncodedSize<certified_plan_t>()) why += verdict.message + "; ";
    }
    EXPECT_GE(sent.size(), 9u);
    if (shadow) EXPECT_EQ(taken, 0);
    if (!shadow) EXPECT_GT(taken, 0) << "the guard is one that takes certificates of this task: " << why;
    if (shadow) EXPECT_EQ(guard.pending(), nullptr);
  }
}

TEST_F(ArmedNodeTest, AShadowStopsNoRobotAndSaysItsFaultInItsHeartbeat) {
  config_.gate.shadow = true;
  Restart();
  bus_->Subscribe("FAULT", [this](const Received& r) { faults_.push_back(Decoded<fault_t>(r.bytes).value()); });
  SayState(State());
  ASSERT_EQ(Ask().cause, decision_t::CAUSE_SHADOW);
  now_us_ += 10'000'000;  // the robot has fallen silent
  Run();
  EXPECT_EQ(node_->watch().state(), Watch::State::kFault);
  EXPECT_TRUE(faults_.empty());
  EXPECT_EQ(status_.back().fault, fault_t::ROBOT_STATE_LOST);
}

TEST_F(ArmedNodeTest, TheBudgetDecidesBeforeTheDeadlineAndWithdrawsWhatTookLonger) {
  SayState(State());
  for (const std::int64_t left : {5000, 4999}) {
    candidate_plan_t candidate = Candidate(next_plan_id_++, 0, now_us_);
    candidate.start_utime = now_us_ + left;
    bus_->Publish("PLAN_CANDIDATE", candidate);
    Run();
    EXPECT_EQ(decisions_.back().outcome, left == 5000 ? decision_t::CERTIFIED : decision_t::ABSTAIN_DEADLINE);
  }
  EXPECT_EQ(decisions_.back().cause, decision_t::CAUSE_DEADLINE);

  for (const std::int64_t taken : {5000, 5001}) {
    std::int64_t now = now_us_;
    Gate gate(config_);
    const GateAnswer answer =
        gate.Decide(Encode(Candidate(1, 0, now_us_)), [&] { return std::exchange(now, now_us_ + taken); });
    EXPECT_EQ(answer.certified.has_value(), taken == 5000);
    EXPECT_EQ(answer.decision.cause, taken == 5000 ? decision_t::CAUSE_NONE : decision_t::CAUSE_OVERRUN);
  }
}

TEST_F(ArmedNodeTest, CommandsThatAreStaleOrUnknownAreRefused) {
  SayState(State());
  Pass(2'000'000);
  Run();
  ASSERT_TRUE(node_->watch().fault());
  command_t command{.utime = now_us_ - 500'001, .kind = command_t::RESET};
  bus_->Publish("COMMAND", command);
  command.utime = now_us_;
  command.kind = 7;
  bus_->Publish("COMMAND", command);
  Run();
  EXPECT_TRUE(node_->watch().fault());
  Reset();
  EXPECT_FALSE(node_->watch().fault());
}

}  // namespace forereach::armed_node_test
