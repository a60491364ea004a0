// The certifier's node and the simulated robot on one bus and a simulated clock: a wall appears while the robot drives.
#include "tests/test.h"

#include "certifier/process/certifier_node.h"
#include "simulator/sim_node.h"
#include "tests/certifier/small_task.h"

namespace forereach::withdrawn_drive_test {

constexpr std::int64_t kStepUs = 150'000;
constexpr int kSteps = 34, kProgress = 24;

// Loses messages as a test wants it.
class LossyBus final : public Bus {
 public:
  using Bus::Publish;
  explicit LossyBus(Bus& bus) : bus_(bus) {}
  void Subscribe(const std::string& channel, Handler handler) override { bus_.Subscribe(channel, std::move(handler)); }
  bool Publish(const std::string& channel, Bytes bytes) override {
    if (const auto lost = to_lose.find(channel); lost != to_lose.end() && lost->second > 0) return --lost->second, true;
    return bus_.Publish(channel, bytes);
  }
  int Dispatch(int timeout_ms) override { return bus_.Dispatch(timeout_ms); }
  std::int64_t dropped() const override { return 0; }

  std::map<std::string, int> to_lose;  // the next so many, by channel

 private:
  Bus& bus_;
};

Config Task() {
  Config config = SmallTaskOnTheBus();
  config.obstacles.clear();
  config.grounds = GroundsOf(DigestOf(std::string_view("drive")), *config.problem, config.obstacles);
  config.gate.needs_robot_state = true;
  config.robot.start = {0, 0, 1, 0};
  config.robot.step_period_ms = kStepUs / 1e3;
  return config;
}

struct WithdrawnDriveTest : testing::Test {
  explicit WithdrawnDriveTest(Config config = Task()) : config_(std::move(config)) {
    Hear(*bus_, "PLAN_WITHDRAWN", withdrawn_);
    Hear(*bus_, "PLAN_CERTIFIED", certified_);
    Hear(*bus_, "PLAN_DECISION", decisions_);
    Hear(*bus_, "EXECUTION_EVENT", events_);
    Hear(*bus_, "ROBOT_STATE", states_);
  }

  void Begin() { certifier_ = std::make_unique<CertifierNode>(config_, lossy_, Clocks{clock_, clock_}); }

  void SendObstacles() { bus_->Publish("OBSTACLES", Sighted(obstacles_, now_ - stamps_late_us_, sequence_++)); }
  void RunFor(std::int64_t us) {
    for (const std::int64_t end = now_ + us; now_ < end; now_ += 2000) {
      if (now_ >= next_obstacles_) {
        next_obstacles_ = now_ + 100'000;
        SendObstacles();
      }
      robot_.Tick(now_);
      bus_->Dispatch(0);
      if (certifier_) certifier_->Tick(now_);
      bus_->Dispatch(0);
    }
  }
  // 1 m/s, then ten steps to rest. From `state` at a step boundary.
  candidate_plan_t Plan(std::int64_t plan_id, std::int64_t start_utime, const double (&state)[4], int progress) const {
    candidate_plan_t plan = Candidate(plan_id, 0, now_);
    plan.sequence = plan_id;
    plan.start_utime = start_utime;
    plan.progress_steps = static_cast<std::int16_t>(progress);
    plan.num_steps = static_cast<std::int16_t>(progress + kSteps - kProgress);
    std::memcpy(plan.initial_center, state, sizeof state);
    for (int k = 0; k < 4; ++k) plan.initial_half_width[k] = 0.01;
    for (int t = progress; t < plan.num_steps; ++t) plan.control[t][0] = -1 / (0.15 * (kSteps - kProgress));
    return plan;
  }
  // The robot drives its plan 1 since step 0.
  void Drive(std::int64_t us = 0) {
    Begin();
    RunFor(20'000);
    const std::int64_t first = states_.front().utime;
    bus_->Publish("PLAN_CANDIDATE", Plan(1, first + 3 * kStepUs, {0, 0, 1, 0}, kProgress));
    while (Step() < 0 && now_ < kNow + 2'000'000) RunFor(2000);
    ASSERT_EQ(Step(), 0);
    RunFor(us);
  }
  void ExpectThePlanEnded() const {
    EXPECT_THAT(Kinds(), Contains(execution_event_t::STANDING));
    EXPECT_THAT(Kinds(), Not(Contains(execution_event_t::EMERGENCY_STOP)));
  }
  void SeeWall(double offset) {
    obstacles_.push_back(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), offset));
    SendObstacles();
  }
  void SeeDisc() { obstacles_ = {Obstacle::Circle(Eigen::Vector2d(3, 3), 0.5)}; }
  int Step() const { return states_.empty() ? -1 : states_.back().executing_step; }
  double Place() const { return robot_.state()[0]; }
  std::vector<int> Kinds() const {
    std::vector<int> kinds;
    for (const execution_event_t& event : events_) kinds.push_back(event.kind);
    return kinds;
  }
  // The first slice that reaches the wall.
  int FirstTouch(double offset) const {
    int t = 0;
    while (certified_.at(0).slice_upper[t][0] < offset) ++t;
    return t;
  }

  std::int64_t now_ = kNow, sequence_ = 0, next_obstacles_ = kNow, stamps_late_us_ = 0;
  const Clock clock_ = [this] { return now_; };
  const Config config_;
  std::vector<Obstacle> obstacles_;
  std::unique_ptr<Bus> bus_ = OpenBus("memq://", clock_);
  LossyBus lossy_{*bus_};
  std::ostringstream out_;
  RobotSimNode robot_{config_, *bus_, out_};
  std::unique_ptr<CertifierNode> certifier_;
  std::vector<withdrawal_t> withdrawn_;
  std::vector<certified_plan_t> certified_;
  std::vector<decision_t> decisions_;
  std::vector<execution_event_t> events_;
  std::vector<robot_state_t> states_;
};

TEST_F(WithdrawnDriveTest, AWallThatAppearsOnTheWayStopsTheRobotBeforeIt) {
  Drive(200'000);
  SeeWall(2);
  RunFor(4'000'000);
  ASSERT_EQ(withdrawn_.size(), 1u) << "answered at once";
  EXPECT_FIELDS(withdrawn_[0], (cause, withdrawal_t::OBSTACLE), (first_step, 1), (valid_steps, FirstTouch(2) - 1));
  EXPECT_THAT(Kinds(),
              AllOf(Contains(execution_event_t::WITHDRAWN).Times(1),
                    Contains(execution_event_t::EMERGENCY_STOP).Times(1), Not(Contains(execution_event_t::CONTACT))));
  EXPECT_LT(Place(), 2);
  EXPECT_GT(Place(), 2 - 0.15 - 0.15) << "it has used what stood";
  EXPECT_EQ(states_.back().mode, robot_state_t::STANDING);
  EXPECT_EQ(decisions_.size(), 1u) << "no second decision for a candidate";
}

TEST_F(WithdrawnDriveTest, AWallBehindTheEndOfThePlanWithdrawsNothing) {
  Drive(200'000);
  SeeWall(certified_.at(0).slice_upper[kSteps][0] + 0.01);
  RunFor(6'000'000);
  EXPECT_TRUE(withdrawn_.empty());
  ExpectThePlanEnded();
}

TEST_F(WithdrawnDriveTest, AWallInFrontOfTheRobotStopsItBeforeTheNextBoundary) {
  Drive(200'000);
  const int step = Step();
  SeeWall(certified_.at(0).slice_upper[step + 1][0] - 0.001);
  RunFor(4000);
  EXPECT_EQ(withdrawn_.at(0).valid_steps, step);
  EXPECT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP));
  EXPECT_EQ(robot_.state()[2], 0);
}

TEST_F(WithdrawnDriveTest, LostWithdrawalsAreRepeated) {
  Drive(200'000);
  lossy_.to_lose["PLAN_WITHDRAWN"] = 3;
  SeeWall(2);
  RunFor(4'000'000);
  EXPECT_EQ(Only(withdrawn_).sequence, 3);
  EXPECT_LT(Place(), 2);
  EXPECT_THAT(Kinds(), Not(Contains(execution_event_t::CONTACT)));
}

// Replayed from before: a certifier that was restarted counts its withdrawals from 0 again.
TEST_F(WithdrawnDriveTest, AnOldAnswerDoesNotStopTheRepetition) {
  Drive(200'000);
  lossy_.to_lose["PLAN_WITHDRAWN"] = 3;
  SeeWall(2);
  RunFor(4000);
  execution_event_t old{.utime = now_ - 500'001, .plan_id = 1, .kind = execution_event_t::WITHDRAWN};
  bus_->Publish("EXECUTION_EVENT", old);
  RunFor(4'000'000);
  EXPECT_EQ(Only(withdrawn_).sequence, 3);
  EXPECT_LT(Place(), 2);
}

// It is refused whole, so the wall in it is not known. The next good message tells.
TEST_F(WithdrawnDriveTest, AMessageThatIsRefusedWithdrawsNothing) {
  Drive();
  RunFor(150'000);
  obstacles_ = {Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 2)};
  obstacles_t message = Sighted(obstacles_, now_, sequence_++);
  message.num_obstacles = 2;  // the second has kind 0
  bus_->Publish("OBSTACLES", message);
  next_obstacles_ = now_ + 300'000;
  RunFor(300'000);
  EXPECT_TRUE(withdrawn_.empty());
  EXPECT_NE(certifier_->gate().WhyObstaclesUnknown(now_), "");
  RunFor(4'000'000);
  ASSERT_EQ(withdrawn_.size(), 1u);
  EXPECT_LT(Place(), 2);
}

TEST_F(WithdrawnDriveTest, APlanThatHasNotBegunIsDropped) {
  Begin();
  RunFor(20'000);
  bus_->Publish("PLAN_CANDIDATE", Plan(1, states_.front().utime + 8 * kStepUs, {0, 0, 1, 0}, kProgress));
  RunFor(20'000);
  ASSERT_EQ(certified_.size(), 1u);
  SeeWall(2);
  RunFor(3'000'000);
  ASSERT_EQ(withdrawn_.size(), 1u);
  EXPECT_EQ(Place(), 0);
  EXPECT_THAT(Kinds(), Not(Contains(execution_event_t::STARTED)));
}

TEST_F(WithdrawnDriveTest, ANewerCertificateTakesOverWithinWhatStands) {
  Drive(200'000);
  SeeWall(2);
  RunFor(10'000);
  ASSERT_EQ(withdrawn_.size(), 1u);
  const int handover = Step() + 2;
  ASSERT_LT(handover, withdrawn_[0].valid_steps);
  bus_->Publish("PLAN_CANDIDATE",
                Plan(2, certified_[0].plan.start_utime + handover * kStepUs, {0.15 * handover, 0, 1, 0}, 0));
  RunFor(4'000'000);
  ASSERT_EQ(certified_.size(), 2u) << GetText(decisions_.back().message);
  ExpectThePlanEnded();
  EXPECT_LT(Place(), 2);
  EXPECT_EQ(withdrawn_.size(), 1u);
}

TEST_F(WithdrawnDriveTest, AFalsifiedDeclarationStopsTheRobotEvenIfItsFaultIsLost) {
  Drive(200'000);
  lossy_.to_lose["FAULT"] = 1000;
  bus_->Publish("TRANSITION", AtRest(now_, 1));
  RunFor(10'000);
  ASSERT_FALSE(withdrawn_.empty());
  EXPECT_FIELDS(withdrawn_[0], (cause, withdrawal_t::FALSIFIED), (valid_steps, 0));
  EXPECT_EQ(robot_.state()[2], 0);
}

// The robot brakes by 1 m/s^2: from 1 m/s in seven steps.
struct BrakingDriveTest : WithdrawnDriveTest {
  BrakingDriveTest() : WithdrawnDriveTest(WithBrake()) {}
  static Config WithBrake() {
    Config config = Task();
    config.period = 0.15;
    config.robot.emergency_stop = {{"vx", 1}};
    return config;
  }
  const execution_event_t& Stop() const {
    return *std::ranges::find(events_, execution_event_t::EMERGENCY_STOP, &execution_event_t::kind);
  }
  // The steps of a stop from any state of a slice.
  int StepsFrom(int step) const { return static_cast<int>(std::ceil(certified_.at(0).slice_upper[step][2] / 0.15)); }
};

TEST_F(BrakingDriveTest, TheStopEndsWithinWhatStandsAndBeginsNoStepTooEarly) {
  Drive(200'000);
  SeeWall(2.5);
  RunFor(5'000'000);
  ASSERT_EQ(withdrawn_.size(), 1u);
  ASSERT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP).Times(1));
  const int standing = withdrawn_[0].valid_steps;
  EXPECT_LE(Stop().step + StepsFrom(Stop().step), standing);
  EXPECT_GT(Stop().step + 1 + StepsFrom(Stop().step + 1), standing) << "a step later it might not have fitted";
  EXPECT_GT(Stop().step, 1) << "it has used what stood";
  const auto rest = std::ranges::find_if(
      states_, [this](const robot_state_t& state) { return state.utime > Stop().utime && state.state[2] == 0; });
  ASSERT_NE(rest, states_.end());
  EXPECT_LE(rest->utime, certified_[0].plan.start_utime + standing * kStepUs) << "in time";
  EXPECT_LT(Place(), 2.5);
  EXPECT_THAT(Kinds(), Not(Contains(execution_event_t::CONTACT)));
}

TEST_F(BrakingDriveTest, WhereTooFewStepsStandItStopsAtOnceAndSaysSo) {
  Drive(200'000);
  const int step = Step();
  SeeWall(certified_.at(0).slice_upper[step + 4][0] - 0.001);
  RunFor(10'000);
  ASSERT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP).Times(1));
  EXPECT_FIELDS(Stop(), (step, step), (value, 7));
  EXPECT_THAT(GetText(Stop().message), HasSubstr("; 3 stand, the stop takes 7 steps"));
  EXPECT_GT(robot_.state()[2], 0) << "it takes its time";
  RunFor(3'000'000);
  EXPECT_EQ(robot_.state()[2], 0);
}

// ---- Obstacles that nobody says any more, or that nobody can use.

Config TaskThatLoses(double after_ms) {
  Config config = Task();
  config.gate.obstacles_lost_ms = after_ms;
  return config;
}

struct LostObstaclesDriveTest : WithdrawnDriveTest {
  explicit LostObstaclesDriveTest(double after_ms = 1000) : WithdrawnDriveTest(TaskThatLoses(after_ms)) {}

  // From now on all that comes is a wall across the way, with stamps that are 2 s old.
  void DriveOnWithAStaleWall(std::int64_t us) {
    obstacles_.push_back(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), Place() + 3));
    stamps_late_us_ = 2'000'000;
    RunFor(us);
  }
};

TEST_F(LostObstaclesDriveTest, AWallThatComesTooLateToBeTakenStopsTheRobotAfterTheTime) {
  Drive();
  DriveOnWithAStaleWall(950'000);
  EXPECT_TRUE(withdrawn_.empty());
  EXPECT_THAT(Kinds(), Not(Contains(execution_event_t::EMERGENCY_STOP)));
  RunFor(300'000);
  ASSERT_FALSE(withdrawn_.empty());
  EXPECT_FIELDS(withdrawn_[0], (cause, withdrawal_t::OBSTACLES_LOST), (valid_steps, 0));
  EXPECT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP).Times(1));
  const auto stop = std::ranges::find(events_, execution_event_t::EMERGENCY_STOP, &execution_event_t::kind);
  EXPECT_THAT(GetText(stop->message), HasSubstr("emergency stop, not certified"));
  const std::size_t sent = withdrawn_.size();
  RunFor(500'000);
  EXPECT_EQ(withdrawn_.size(), sent) << "it has answered";
}

TEST_F(LostObstaclesDriveTest, ASenderThatIsSilentForLessChangesNothing) {
  Drive();
  DriveOnWithAStaleWall(900'000);
  obstacles_.clear();
  stamps_late_us_ = 0;
  RunFor(6'000'000);
  EXPECT_TRUE(withdrawn_.empty());
  ExpectThePlanEnded();
}

struct NeverLostDriveTest : LostObstaclesDriveTest {
  NeverLostDriveTest() : LostObstaclesDriveTest(kNeverLost) {}
};

TEST_F(NeverLostDriveTest, ThePlanGoesThroughThePlaceOfTheWall) {
  Drive();
  DriveOnWithAStaleWall(6'000'000);
  EXPECT_TRUE(withdrawn_.empty());
  EXPECT_THAT(Kinds(), Contains(execution_event_t::STANDING));
}

// The certifier restarts while the robot executes what its predecessor certified, which may have had other transitions
// under the same task file.
struct RestartedCertifierTest : WithdrawnDriveTest {
  explicit RestartedCertifierTest(Config config = Task()) : WithdrawnDriveTest(std::move(config)) {}

  void Drive() {
    Gate predecessor(config_);
    Drive(predecessor);
  }
  Config WithOtherTransitions() const {
    Config config = config_;
    Problem& problem = Own(config.problem);
    problem.transitions.z.row(1).swap(problem.transitions.z.row(0));
    problem.transitions.x_next.row(1).swap(problem.transitions.x_next.row(0));
    config.grounds = GroundsOf(config_.grounds.config, problem, config_.obstacles);
    return config;
  }
  transition_t Learned() const {
    transition_t learned = AtRest(now_, 1.5);
    learned.state[2] = 1.5;
    learned.next_state[0] = 1.5 * 0.15;
    return learned;
  }
  void SendPlan(Gate& predecessor) {
    ASSERT_EQ(predecessor.UpdateObstacles(Encode(ToMessage(obstacles_, now_)), now_), "");
    RunFor(20'000);
    const auto plan = Plan(1, states_.front().utime + 3 * kStepUs, {0, 0, 1, 0}, kProgress);
    bus_->Publish("PLAN_CERTIFIED", predecessor.Decide(Encode(plan), now_).certified.value());
  }
  void Drive(Gate& predecessor) {
    SendPlan(predecessor);
    while (Step() < 0 && now_ < kNow + 2'000'000) RunFor(2000);
    RunFor(200'000);
  }
  void ExpectAStopAfterTheStart() {
    Begin();
    RunFor(300'000);
    EXPECT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP).Times(1));
  }
};

TEST_F(RestartedCertifierTest, ThePlanGoesOnWhereNothingHasChanged) {
  SeeDisc();
  Drive();
  Begin();
  RunFor(6'000'000);
  EXPECT_EQ(Only(withdrawn_).cause, withdrawal_t::UNKNOWN_PLAN);
  EXPECT_GT(certifier_->gate().certifier().num_observations(), 2u) << "what it learns itself takes nothing back";
  ExpectThePlanEnded();
}

// The certifier does not know what is in the way of the plan that it finds, and has not certified it.
struct RestartedAmongLostObstaclesTest : RestartedCertifierTest {
  RestartedAmongLostObstaclesTest() : RestartedCertifierTest(TaskThatLoses(1000)) {}
};

TEST_F(RestartedAmongLostObstaclesTest, ThePlanStopsAfterTheTime) {
  Drive();
  stamps_late_us_ = 2'000'000;
  Begin();
  RunFor(950'000);
  EXPECT_TRUE(withdrawn_.empty());
  RunFor(300'000);
  ASSERT_FALSE(withdrawn_.empty());
  EXPECT_EQ(withdrawn_[0].cause, withdrawal_t::OBSTACLES_LOST);
  EXPECT_EQ(GetDigest(withdrawn_[0].certificate_digest), Digest{});
  EXPECT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP).Times(1));
}

TEST_F(RestartedCertifierTest, ThePlanStopsWhereItHadOtherTransitionsOfTheTask) {
  Gate predecessor(WithOtherTransitions());
  Drive(predecessor);
  ExpectAStopAfterTheStart();
}

// What its predecessor had learned stays true.
TEST_F(RestartedCertifierTest, ThePlanGoesOnWhereItRestsOnLearnedTransitions) {
  Gate predecessor(config_);
  ASSERT_EQ(predecessor.Learn(Encode(Learned())), "");
  ASSERT_NE(predecessor.grounds().observations, predecessor.transitions());
  Drive(predecessor);
  Begin();
  RunFor(6'000'000);
  EXPECT_EQ(Only(withdrawn_).cause, withdrawal_t::UNKNOWN_PLAN);
  ExpectThePlanEnded();
}

TEST_F(RestartedCertifierTest, ThePlanStopsWhereTheSameWasLearnedAfterAnotherFile) {
  Gate predecessor(WithOtherTransitions());
  ASSERT_EQ(predecessor.Learn(Encode(Learned())), "");
  Drive(predecessor);
  ExpectAStopAfterTheStart();
}

// The restarted certifier learns what contradicts the declaration: what it names then, no certificate rests on.
TEST_F(RestartedCertifierTest, ThePlanStopsWhereSomethingIsLearnedThatContradicts) {
  Gate predecessor(config_);
  ASSERT_EQ(predecessor.Learn(Encode(Learned())), "");
  Drive(predecessor);
  Begin();
  RunFor(300'000);
  EXPECT_THAT(Kinds(), Not(Contains(execution_event_t::EMERGENCY_STOP)));
  lossy_.to_lose["FAULT"] = 1000;
  transition_t contradiction = Learned();
  contradiction.utime = now_;
  contradiction.next_state[2] = 3;
  bus_->Publish("TRANSITION", contradiction);
  RunFor(300'000);
  EXPECT_EQ(withdrawn_.back().cause, withdrawal_t::UNKNOWN_PLAN);
  EXPECT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP).Times(1));
}

TEST_F(RestartedCertifierTest, ThePlanStopsWhereACertifierOfAnotherTaskWasInBetween) {
  Drive();
  Config other = config_;
  other.grounds.config = DigestOf("another task");
  certifier_ = std::make_unique<CertifierNode>(other, lossy_, Clocks{clock_, clock_});
  RunFor(300'000);
  EXPECT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP).Times(1));
}

TEST_F(RestartedCertifierTest, APlanThatHadNotBegunStopsOnceItHas) {
  Gate predecessor(config_);
  SendPlan(predecessor);
  SeeDisc();
  Begin();
  RunFor(1'000'000);
  EXPECT_THAT(Kinds(), Contains(execution_event_t::STARTED));
  EXPECT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP).Times(1));
  EXPECT_LT(Place(), 0.16) << "within a step";
}

TEST_F(RestartedCertifierTest, ThePlanStopsWhereAnObstacleIsGone) {
  SeeDisc();
  Drive();
  obstacles_.clear();
  ExpectAStopAfterTheStart();
}

// Nothing is known then, so nothing can be judged. It stops as soon as it is known.
TEST_F(RestartedCertifierTest, ThePlanGoesOnWhileNobodySendsObstacles) {
  SeeDisc();
  Drive();
  obstacles_.clear();
  next_obstacles_ = INT64_MAX;
  Begin();
  RunFor(1'000'000);
  EXPECT_TRUE(withdrawn_.empty());
  EXPECT_THAT(Kinds(), Not(Contains(execution_event_t::EMERGENCY_STOP)));
  next_obstacles_ = now_;
  RunFor(300'000);
  EXPECT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP).Times(1));
}

TEST_F(RestartedCertifierTest, ThePlanStopsWhereSomethingHasChangedMeanwhile) {
  Drive();
  SeeDisc();
  Begin();
  RunFor(300'000);
  EXPECT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP));
}

TEST_F(RestartedCertifierTest, ThePlanStopsWhereSomethingChangesLater) {
  Drive();
  Begin();
  RunFor(500'000);
  EXPECT_THAT(Kinds(), Not(Contains(execution_event_t::EMERGENCY_STOP)));
  SeeDisc();
  RunFor(200'000);
  EXPECT_THAT(Kinds(), Contains(execution_event_t::EMERGENCY_STOP));
}

}  // namespace forereach::withdrawn_drive_test
