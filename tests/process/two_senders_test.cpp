// Two processes under one key on one stream: the certifier certifies nothing on what either of them says.
#include "tests/test.h"

#include <thread>

#include "certifier/gate/obstacle_sender.h"
#include "certifier/process/certifier_node.h"
#include "tests/certifier/signed_air.h"
#include "tests/certifier/small_task.h"

namespace forereach::two_senders_test {

constexpr std::int64_t kTick = 5'000;
constexpr std::int64_t kTimeout = 1'000'000;  // of obstacles and of the robot's state, by default
constexpr std::uint64_t kTrueOne = 0xaaaa, kOldOne = 0xbbbb;

// A certifier on a signed bus. Only PLAN_CANDIDATE has a planner all the time.
struct TwoSendersTest : testing::Test {
  TwoSendersTest() {
    config_.obstacles.clear();
    Begin();
  }

  void Begin() {
    node_.reset();
    air_ = OpenAir(clock_, {"PLAN_DECISION", "PLAN_CERTIFIED", "PLAN_WITHDRAWN", "CERTIFIER_STATUS", "FAULT"});
    node_ = std::make_unique<CertifierNode>(config_, *air_, Clocks{clock_, clock_});
    withdrawals_.clear();
    faults_.clear();
    Hear(*air_, "PLAN_DECISION", decisions_);
    Hear(*air_, "PLAN_WITHDRAWN", withdrawals_);
    Hear(*air_, "CERTIFIER_STATUS", status_);
    Hear(*air_, "FAULT", faults_);
    planner_.emplace(*air_, Role::kPlanner, 1);
  }

  void Run() {
    air_->Dispatch(0);
    node_->Tick(now_us_);
    air_->Dispatch(0);
  }
  decision_t Ask() {
    planner_->Say("PLAN_CANDIDATE", Candidate(next_plan_id_++, kAccelerationThatCertifies, now_us_), now_us_);
    Run();
    return decisions_.back();
  }
  // Every tick for so long.
  template <class Each>
  void For(std::int64_t time_us, Each each) {
    for (const std::int64_t end = now_us_ + time_us; now_us_ < end; now_us_ += kTick) {
      each();
      Run();
    }
  }

  std::int64_t now_us_ = kNow;
  const Clock clock_ = [this] { return now_us_; };
  Config config_ = SmallTaskOnTheBus();
  std::unique_ptr<Bus> air_;
  std::unique_ptr<CertifierNode> node_;
  std::optional<Speaking> planner_;
  std::vector<decision_t> decisions_;
  std::vector<withdrawal_t> withdrawals_;
  std::vector<fault_t> faults_;
  certifier_status_t status_{};
  std::int64_t next_plan_id_ = 1;
};

// A perception process as users build it.
class Watching final {
 public:
  Watching(Bus& air, std::uint64_t id, std::int64_t period_us, const std::vector<Obstacle>& seen)
      : speaking_(air, Role::kPerception, id), sender_(period_us) {
    sender_.Set(seen);
  }
  void Tick(std::int64_t now_us) {
    if (const auto message = sender_.Due(now_us)) last_ = speaking_.Say("OBSTACLES", *message, now_us);
  }
  Speaking& speaking() { return speaking_; }
  [[nodiscard]] const std::vector<std::uint8_t>& last() const { return last_; }

 private:
  Speaking speaking_;
  ObstacleSender sender_;
  std::vector<std::uint8_t> last_;
};

const std::vector<Obstacle> kWall{Obstacle::Circle(Eigen::Vector2d(1, 0), 0.3)};

struct TwoPerceptionsTest : TwoSendersTest, testing::WithParamInterface<int> {
  static std::int64_t Period() { return ObstacleSender::PeriodUs(GateOptions{}); }
  void ExpectCertified(const char* when) { EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED) << when; }
};

// The old one knows nothing of the wall.
TEST_P(TwoPerceptionsTest, TheWallOfTheTrueOneIsNeverCertifiedThrough) {
  for (const bool old_one_first : {true, false}) {
    Begin();
    Watching old_one(*air_, kOldOne, Period() / GetParam(), {}), true_one(*air_, kTrueOne, Period(), kWall);
    const std::int64_t begin = now_us_;
    For(5 * kTimeout, [&] {
      if (old_one_first || now_us_ - begin >= Period() / 2) old_one.Tick(now_us_);
      if (!old_one_first || now_us_ - begin >= Period() / 2) true_one.Tick(now_us_);
      EXPECT_NE(Ask().outcome, decision_t::CERTIFIED) << now_us_ - begin << " us after the start";
    });
    EXPECT_THAT(
        GetText(decisions_.back().message),
        AllOf(HasSubstr("two senders are heard"), HasSubstr("000000000000aaaa"), HasSubstr("000000000000bbbb")));
    EXPECT_EQ(status_.obstacles_known, 0);
    EXPECT_THAT(GetText(status_.message), HasSubstr("two senders are heard"));
  }
}

INSTANTIATE_TEST_SUITE_P(TimesTheRate, TwoPerceptionsTest, testing::Values(1, 3, 10));

using PerceptionTest = TwoPerceptionsTest;
INSTANTIATE_TEST_SUITE_P(Once, PerceptionTest, testing::Values(1));

TEST_P(PerceptionTest, OneCountsOnceItWasHeardAloneForTheTimeout) {
  Watching one(*air_, kTrueOne, Period(), {});
  const std::int64_t begin = now_us_;
  For(2 * kTimeout, [&] {
    one.Tick(now_us_);
    EXPECT_EQ(Ask().outcome == decision_t::CERTIFIED, now_us_ - begin > kTimeout) << now_us_ - begin;
  });
}

TEST_P(PerceptionTest, ARestartedOneTakesOverAfterTheTimeoutAndNotLater) {
  Watching before(*air_, kOldOne, Period(), {});
  For(2 * kTimeout, [&] { before.Tick(now_us_); });
  const std::int64_t end = now_us_ - kTick;  // the last time that it may have been heard
  Watching after(*air_, kTrueOne, Period() / 5, kWall);
  std::optional<std::int64_t> took_over;
  For(3 * kTimeout, [&] {
    after.Tick(now_us_);
    Run();
    EXPECT_NE(Ask().outcome, decision_t::CERTIFIED) << "the wall is on the way";
    if (decisions_.back().cause == decision_t::CAUSE_OBSTACLE && !took_over) took_over = now_us_ - end;
  });
  ASSERT_TRUE(took_over);
  EXPECT_LE(*took_over, kTimeout + Period());
  EXPECT_EQ(node_->gate().obstacles().size(), 1u);
}

TEST_P(PerceptionTest, OneThatSpeaksOnceIsForgottenAfterTheTimeout) {
  Watching one(*air_, kTrueOne, Period(), {});
  For(2 * kTimeout, [&] { one.Tick(now_us_); });
  ExpectCertified("alone");
  Watching other(*air_, kOldOne, Period(), {});
  other.Tick(now_us_);
  const std::int64_t spoke = now_us_;
  For(2 * kTimeout, [&] {
    one.Tick(now_us_);
    EXPECT_EQ(Ask().outcome == decision_t::CERTIFIED, now_us_ - spoke > kTimeout) << now_us_ - spoke;
  });
}

// Its messages are too old to be used, and it is there.
TEST_P(PerceptionTest, ASecondOneWhoseClockIsBehindIsASecondOne) {
  Watching one(*air_, kTrueOne, Period(), {});
  For(2 * kTimeout, [&] { one.Tick(now_us_); });
  const std::int64_t behind = now_us_ - 1'500'000;
  Speaking(*air_, Role::kPerception, kOldOne).Say("OBSTACLES", Sighted(kWall, behind), behind);
  EXPECT_NE(Ask().outcome, decision_t::CERTIFIED);
  EXPECT_THAT(GetText(decisions_.back().message), HasSubstr("two senders are heard"));
  EXPECT_TRUE(node_->gate().obstacles().empty()) << "but its message is not used";
}

TEST_P(PerceptionTest, OldMessagesOfAFormerOneAreNotHeardAgain) {
  Watching before(*air_, kOldOne, Period(), {});
  std::vector<std::vector<std::uint8_t>> recorded;
  For(2 * kTimeout, [&] {
    before.Tick(now_us_);
    if (recorded.empty() || recorded.back() != before.last()) recorded.push_back(before.last());
  });
  Watching after(*air_, kTrueOne, Period(), {});
  For(3 * kTimeout, [&] { after.Tick(now_us_); });
  ExpectCertified("it has taken over");
  For(2 * kTimeout, [&] {
    after.Tick(now_us_);
    for (const auto& bytes : recorded) air_->Publish("OBSTACLES", Bytes(bytes));
    ExpectCertified("what was recorded is refused at the signature");
  });
}

TEST_P(PerceptionTest, AFloodOfStartsIsUnknownWhileItLastsAndNotLonger) {
  Watching one(*air_, kTrueOne, Period(), kWall);
  For(2 * kTimeout, [&] { one.Tick(now_us_); });
  std::uint64_t id = 1;
  For(kTimeout, [&] {
    one.Tick(now_us_);
    Watching(*air_, id++, Period(), {}).Tick(now_us_);
    EXPECT_NE(Ask().cause, decision_t::CAUSE_OBSTACLE);
  });
  For(kTimeout + kTick, [&] { one.Tick(now_us_); });
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_OBSTACLE) << "the wall is known as before";
}

// ---- The robot's streams.

struct TwoRobotsTest : TwoSendersTest {
  TwoRobotsTest() {
    config_.gate.obstacles = ObstaclesSource::kTask;
    config_.gate.needs_robot_state = true;
    Begin();
  }
  void Stands(Speaking& robot, std::int64_t sequence) { robot.Say("ROBOT_STATE", StateOf(now_us_, sequence), now_us_); }
  // As many states of one that stands, a tenth of a second apart.
  void StandsFor(Speaking& robot, int count, int first = 0) {
    for (int i = 0; i < count; ++i, now_us_ += 100'000) Stands(robot, first + i), Run();
  }
  // At the first step of the plan. Of every second number, so that none of them follows another.
  void Executes(Speaking& robot, std::int64_t number, std::int64_t plan_id) {
    robot_state_t state = StateOf(now_us_, 2 * number, plan_id, 0);
    std::ranges::copy(Candidate(plan_id).initial_center, state.state);
    robot.Say("ROBOT_STATE", state, now_us_);
  }
  // 20 states of one robot that stands; then a certified plan. @return its plan_id.
  std::int64_t CertifyForOne(Speaking& robot) {
    StandsFor(robot, 20);
    EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
    return decisions_.back().plan_id;
  }
  // Says what makes every certificate void.
  void ContradictTheDeclaration(Speaking& robot) {
    robot.Say("TRANSITION", AtRest(now_us_, 1), now_us_);
    Run();
    EXPECT_EQ(node_->gate().Status(now_us_).learned, 1);
  }
  void Answer(Speaking& robot) {
    execution_event_t event{.utime = now_us_,
                            .plan_id = withdrawals_.back().plan_id,
                            .kind = execution_event_t::WITHDRAWN,
                            .value = static_cast<double>(withdrawals_.back().sequence)};
    robot.Say("EXECUTION_EVENT", event, now_us_);
    Run();
  }
  bool IsSentAgain() {
    const std::size_t sent = withdrawals_.size();
    now_us_ += 60'000;
    Run();
    return withdrawals_.size() > sent;
  }
  Speaking one() { return {*air_, Role::kRobot, kTrueOne}; }
  Speaking other() { return {*air_, Role::kRobot, kOldOne}; }
};

TEST_F(TwoRobotsTest, TwoUnderOneNameGetNoCertificate) {
  Speaking first = one(), second = other();
  std::int64_t sequence = 0;
  const std::int64_t begin = now_us_;
  For(2 * kTimeout, [&] {
    if ((now_us_ - begin) % 100'000 == 0) Stands(first, sequence++);
    EXPECT_EQ(Ask().outcome == decision_t::CERTIFIED, now_us_ - begin > kTimeout + 95'000)
        << "with its first state after the timeout, " << now_us_ - begin;
  });
  For(2 * kTimeout, [&] {
    if ((now_us_ - begin) % 100'000 == 0) Stands(first, sequence++);
    if ((now_us_ - begin) % 25'000 == 0) Stands(second, sequence++);
    Run();
    EXPECT_EQ(Ask().outcome, decision_t::REJECTED);
    EXPECT_EQ(decisions_.back().cause, decision_t::CAUSE_NOT_ARMED);
  });
  const std::string why = "ROBOT_STATE: two senders are heard, 000000000000aaaa and 000000000000bbbb";
  EXPECT_THAT(GetText(decisions_.back().message), HasSubstr(why));
  EXPECT_THAT(GetText(status_.message), HasSubstr(why));
  EXPECT_EQ(status_.state, certifier_status_t::DISARMED);
  EXPECT_TRUE(faults_.empty());
  For(2 * kTimeout, [&] {
    if ((now_us_ - begin) % 100'000 == 0) Stands(first, sequence++);
  });
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED) << "the second one has ended";
}

TEST_F(TwoRobotsTest, NoneIsArmedByTwoThatStartTogether) {
  Speaking first = one(), second = other();
  std::int64_t sequence = 0;
  For(3 * kTimeout, [&] {
    Stands(sequence % 10 == 0 ? second : first, sequence);
    ++sequence;
    EXPECT_NE(Ask().outcome, decision_t::CERTIFIED);
  });
}

TEST_F(TwoRobotsTest, BothSilentIsARobotThatIsLost) {
  Speaking first = one(), second = other();
  for (int i = 0; i < 3; ++i) Stands(first, i), Stands(second, i), Run();
  now_us_ += kTimeout + 1;
  Run();
  EXPECT_EQ(Only(faults_).cause, fault_t::ROBOT_STATE_LOST);
}

TEST_F(TwoRobotsTest, AReloadDoesNotArm) {
  const ScratchDirectory scratch;
  Speaking first = one(), second = other();
  CertifyForOne(first);
  Stands(second, 0);
  Run();
  node_->Reload();  // of a task file that is not there: it stays as it is
  while (reloads_under_way > 0) std::this_thread::yield();
  Run();
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
}

TEST_F(TwoRobotsTest, TransitionsOfTwoAreNotLearned) {
  Speaking first = one(), second = other();
  const auto learned = [&] { return node_->gate().Status(now_us_).learned; };
  first.Say("TRANSITION", AtRest(now_us_), now_us_);
  Run();
  EXPECT_EQ(learned(), 1);
  second.Say("TRANSITION", AtRest(now_us_, 1), now_us_);
  Run();
  EXPECT_EQ(learned(), 1);
  EXPECT_TRUE(faults_.empty());
  now_us_ += kTimeout;
  first.Say("TRANSITION", AtRest(now_us_), now_us_);
  Run();
  EXPECT_EQ(learned(), 1) << "the second one is still heard";
  now_us_ += 1;
  transition_t another = AtRest(now_us_);
  another.state[0] = another.next_state[0] = 1;
  first.Say("TRANSITION", another, now_us_);
  Run();
  EXPECT_EQ(learned(), 2);
}

// The plan stays withdrawn until the robot that has it answers.
TEST_F(TwoRobotsTest, NeitherOfTwoAnswersAWithdrawal) {
  Speaking first = one(), second = other();
  CertifyForOne(first);
  ContradictTheDeclaration(first);
  ASSERT_FALSE(withdrawals_.empty());
  first.Say("EXECUTION_EVENT", execution_event_t{.kind = execution_event_t::ACCEPTED}, now_us_);
  Answer(second);
  EXPECT_TRUE(IsSentAgain());
  Answer(first);
  EXPECT_TRUE(IsSentAgain());
  now_us_ += kTimeout;
  Run();
  Answer(first);
  EXPECT_FALSE(IsSentAgain());
}

// Its events come rarely, so the other one's may be the only ones that are heard.
TEST_F(TwoRobotsTest, NoneAnswersAWithdrawalWhileTheStatesOfTwoAreHeard) {
  Speaking first = one(), second = other();
  CertifyForOne(first);
  Stands(second, 0);
  ContradictTheDeclaration(first);
  ASSERT_FALSE(withdrawals_.empty());
  Answer(second);
  EXPECT_TRUE(IsSentAgain());
  now_us_ += kTimeout;
  Stands(first, 100);
  Answer(second);
  EXPECT_FALSE(IsSentAgain()) << "now one is heard, and it answers";
}

// ---- The plan that one of two executes.

TEST_F(TwoRobotsTest, APlanThatBeganWhileTwoWereHeardIsWithdrawnAsLongAsOneExecutesIt) {
  constexpr std::int64_t kRun = 2'500'000;  // the longest run of the plan after a state in which it is executed
  for (const std::int64_t after : {std::int64_t{0}, kRun, kRun + 1}) {
    Begin();
    Speaking first = one(), second = other();
    const std::int64_t plan = CertifyForOne(first);
    for (int i = 100; i < 150; ++i, now_us_ += 100'000) {  // longer than it could be pending
      Stands(second, i);
      Executes(first, i, plan);
      Run();
    }
    now_us_ += after - 100'000;
    ContradictTheDeclaration(first);
    EXPECT_EQ(withdrawals_.size(), after <= kRun ? 1u : 0u) << after;
  }
}

TEST_F(TwoRobotsTest, APlanThatTheSilentOneMayStillExecuteIsWithdrawnAndNotAnsweredByTheOther) {
  for (const std::int64_t silent : {kTimeout + 200'000, std::int64_t{2'500'000}, std::int64_t{2'500'001}}) {
    Begin();
    Speaking first = one(), second = other();
    const std::int64_t plan = CertifyForOne(first);
    Executes(first, 100, plan);
    Run();
    const std::int64_t last = now_us_;
    for (int i = 0; now_us_ < last + silent; ++i) {
      Stands(second, i);
      Run();
      now_us_ = std::min(now_us_ + 100'000, last + silent);
    }
    ContradictTheDeclaration(second);
    ASSERT_EQ(withdrawals_.size(), silent <= 2'500'000 ? 1u : 0u) << silent;
    if (silent != kTimeout + 200'000) continue;
    Answer(second);
    EXPECT_TRUE(IsSentAgain()) << "the one that executes it has not answered";
  }
}

// The one that stays is not the one that executes it.
TEST_F(TwoRobotsTest, APlanThatTheOneThatFellSilentExecutesStaysThoughTheOtherStands) {
  Speaking first = one(), second = other();
  const std::int64_t plan = CertifyForOne(first);
  Executes(first, 50, plan);
  Executes(second, 0, plan);
  Run();
  StandsFor(first, 15, 101);
  ContradictTheDeclaration(first);
  EXPECT_EQ(withdrawals_.size(), 1u);
}

TEST_F(TwoRobotsTest, APlanThatIsNotKnownIsWithdrawnThoughTwoAreHeard) {
  Speaking first = one(), second = other();
  Stands(second, 0);
  Executes(first, 0, 77);
  Run();
  EXPECT_FIELDS(Only(withdrawals_), (plan_id, 77), (cause, withdrawal_t::UNKNOWN_PLAN));
}

TEST_F(TwoRobotsTest, ThatOneHasFinishedSwitchesNoFaultOffForTheOther) {
  for (const bool are_two : {true, false}) {
    Begin();
    Speaking first = one(), second = other();
    for (int i = 0; i < 3; ++i, now_us_ += 100'000) {
      Stands(first, i);
      if (are_two) Stands(second, i);
      Run();
    }
    robot_state_t finished = StateOf(now_us_, 3);
    finished.mode = robot_state_t::FINISHED;
    (are_two ? second : first).Say("ROBOT_STATE", finished, now_us_);
    Run();
    now_us_ += kTimeout + 1;
    Run();
    ASSERT_EQ(faults_.size(), are_two ? 1u : 0u);
    if (are_two) EXPECT_EQ(faults_[0].cause, fault_t::ROBOT_STATE_LOST);
  }
}

// A message of it was heard, whatever is in it.
TEST_F(TwoRobotsTest, ASecondOneCountsThoughItsMessageCannotBeUsed) {
  for (const bool is_stale : {true, false}) {
    Begin();
    Speaking first = one(), second = other();
    CertifyForOne(first);
    robot_state_t stale{.utime = now_us_ - 600'000, .mode = robot_state_t::STANDING, .num_states = 4};
    if (is_stale)
      second.Say("ROBOT_STATE", stale, now_us_);
    else
      second.Say("ROBOT_STATE", command_t{}, now_us_);
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED) << is_stale;
    EXPECT_THAT(GetText(decisions_.back().message), HasSubstr("two senders are heard"));
  }
}

// ---- gate.arming none: a robot need not be there.

TEST_F(TwoRobotsTest, WithoutArmingTwoThatWereHeardOnceAreForgotten) {
  config_.gate.needs_robot_state = false;
  Begin();
  Speaking first = one(), second = other();
  Stands(first, 0), Stands(second, 0);
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
  now_us_ += kTimeout;
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
  now_us_ += 1;
  Run();
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
}

TEST_F(TwoRobotsTest, WithoutArmingAStateOfAClockThatIsOffIsForgotten) {
  config_.gate.max_clock_error_ms = 60;
  for (const bool needs_robot : {false, true}) {
    config_.gate.needs_robot_state = needs_robot;
    Begin();
    Speaking robot = one();
    robot.Say("ROBOT_STATE", StateOf(now_us_ - 300'000), now_us_);
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
    now_us_ += kTimeout;
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
    now_us_ += 1;
    Run();
    EXPECT_EQ(Ask().outcome == decision_t::CERTIFIED, !needs_robot);
  }
}

// One that is left running may be the one that errs.
TEST_F(TwoRobotsTest, WhatOneOfThemReportsAsWrongCounts) {
  Speaking first = one(), second = other();
  robot_state_t state = StateOf(now_us_, 0, CertifyForOne(first), 0);
  state.utime = now_us_;
  state.state[0] = 10;
  second.Say("ROBOT_STATE", state, now_us_);
  Run();
  EXPECT_EQ(Only(faults_).cause, fault_t::SLICE_LEFT);
}

// ---- Where two are meant.

TEST_F(TwoSendersTest, TwoOperatorsAndTwoPlannersAreHeard) {
  Watching one(*air_, kTrueOne, ObstacleSender::PeriodUs(config_.gate), {});
  For(2 * kTimeout, [&] { one.Tick(now_us_); });
  Speaking second_planner(*air_, Role::kPlanner, 2);
  candidate_plan_t candidate = Candidate(1, kAccelerationThatCertifies, now_us_);
  SetText(candidate.source, "second");
  second_planner.Say("PLAN_CANDIDATE", candidate, now_us_);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  EXPECT_EQ(decisions_.size(), 2u);
  for (const std::uint64_t id : {1u, 2u}) {
    Speaking(*air_, Role::kOperator, id).Say("COMMAND", command_t{.utime = now_us_, .kind = 99}, now_us_);
  }
  const std::int64_t refused = status_.messages_refused;
  For(kTimeout, [&] { one.Tick(now_us_); });
  EXPECT_EQ(status_.messages_refused, refused + 2) << "both are obeyed as far as they are commands";
}

// ---- What was signed before the start, or ahead of the clock.

// The certifier has one ahead of it in the record of an hour in which a clock was ahead, and starts again.
TEST_F(TwoRobotsTest, ATransitionThatWasSignedWhileAClockWasAheadDoesNotLatchTheNextCertifier) {
  const transition_t false_one = AtRest(now_us_, 1);
  std::vector<std::vector<std::uint8_t>> recorded;
  for (const std::int64_t off :
       std::initializer_list<std::int64_t>{-3'600'000'000, -1'000'000, -1, 1'000'001, 10'000'000, 3'600'000'000})
    recorded.push_back(one().Say("TRANSITION", false_one, now_us_ + off));
  Begin();
  for (const auto& bytes : recorded) air_->Publish("TRANSITION", Bytes(bytes));
  Run();
  EXPECT_TRUE(faults_.empty());
  EXPECT_EQ(node_->gate().Status(now_us_).learned, 0);
  EXPECT_FIELDS(air_->refusals(), (all(), 6), (ahead, 3));
  For(kTimeout, [] {});
  EXPECT_EQ(status_.refused_replayed, 6) << "the heartbeat says it";
}

// 600 s apart: all that perception says is refused. The heartbeat says so while it lasts, and of whom.
TEST_F(TwoRobotsTest, TheHeartbeatNamesARoleWhoseClockIsApart) {
  for (const std::int64_t seconds : {600, -600}) {
    Begin();
    const obstacles_t obstacles{.utime = now_us_ + seconds * 1'000'000};
    Speaking perception(*air_, Role::kPerception, 5);
    For(kTimeout, [&] { perception.Say("OBSTACLES", obstacles, now_us_ + seconds * 1'000'000); });
    EXPECT_THAT(GetText(status_.message), StartsWith(seconds > 0 ? "perception's messages are signed 600 s ahead of"
                                                                 : "perception's messages are signed 600 s before"));
    For(2 * kTimeout, [] {});
    EXPECT_THAT(GetText(status_.message), Not(HasSubstr("perception")));
  }
}

}  // namespace forereach::two_senders_test
