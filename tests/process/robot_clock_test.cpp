// The robot's clock. E is 60 ms, D is 10 ms.
#include "tests/test.h"

#include "tests/process/certifier_node_fixture.h"

namespace forereach::robot_clock_test {

struct RobotClockTest : ArmedNodeTest {
  RobotClockTest() {
    config_.gate.max_clock_error_ms = 60;
    config_.bus.delay_ms = 10;
    config_.gate.obstacles = ObstaclesSource::kBus;
    config_.gate.obstacles_lost_ms = kNeverLost;
    Begin();
  }

  void Begin() {
    Restart();
    next_seen_ = 0;
    See(0);
  }

  // Their arrival is so much after their stamp.
  void SayStateLate(std::int64_t late_us) {
    robot_state_t state = State();
    state.utime -= late_us;
    SayState(state);
  }
  void See(std::int64_t late_us) {
    bus_->Publish("OBSTACLES", Sighted({}, now_us_ - late_us, next_seen_++));
    Run();
  }
  void ExpectNotArmed(const std::string& why) {
    const decision_t decision = Ask();
    EXPECT_EQ(decision.cause, decision_t::CAUSE_NOT_ARMED);
    EXPECT_THAT(GetText(decision.message), HasSubstr(why));
    Pass(CertifierNode::kHeartbeatUs);
    Run();
    EXPECT_FIELDS(status_.back(), (level, certifier_status_t::STALE), (state, certifier_status_t::DISARMED));
    EXPECT_THAT(GetText(status_.back().message), HasSubstr(why));
  }

  std::int64_t next_seen_ = 0;
};

TEST_F(RobotClockTest, OneThatIsBehindFromTheStartArmsNothing) {
  for (int i = 0; i < 20; ++i) {
    Pass(150'000);
    See(0);
    SayStateLate(473'000);
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED) << "nothing is learned of it";
  }
  ExpectNotArmed(
      "the robot's clock is behind, or its messages are late: the last one arrived 473 ms after its stamp, at "
      "most 70 ms are allowed");
  EXPECT_TRUE(certified_.empty());
  EXPECT_TRUE(faults_.empty()) << "a need, which a clock that is set right meets by itself";
  SayStateLate(0);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
}

TEST_F(RobotClockTest, ItMayBeLateByErrorAndDelayAndEarlyByTheError) {
  for (const std::int64_t late_us : {70'000, -50'000}) {  // gate.max_ahead_ms is 50
    SayStateLate(late_us);
    EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED) << late_us;
  }
  SayStateLate(70'001);
  ExpectNotArmed("the robot's clock is behind");
  See(0);
  SayStateLate(0);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
}

TEST_F(RobotClockTest, OneThatIsAheadArmsNothing) {
  config_.gate.max_ahead_ms = 500;
  Begin();
  SayStateLate(-60'000);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  SayStateLate(-60'001);
  ExpectNotArmed(
      "the robot's clock is ahead: the last message arrived 60 ms before its stamp, at most 60 ms are allowed");
}

// A hiccup costs the time to the next state, and no person has to come.
TEST_F(RobotClockTest, AfterOneDatagramThatIsLateTheNextOneArms) {
  SayStateLate(1000);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  SayStateLate(90'000);
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED) << "not armed while the newest state is outside";
  SayStateLate(1000);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  EXPECT_TRUE(faults_.empty());
}

// It is older than any message may be, and so it is refused. It says nothing good of the clock.
TEST_F(RobotClockTest, AStateThatIsRefusedForItsStampDisarmsAtOnce) {
  for (const std::int64_t late_us : std::initializer_list<std::int64_t>{500'001, -50'001, 3'600'000'000}) {
    SayStateLate(0);
    EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
    SayStateLate(late_us);
    EXPECT_EQ(Ask().outcome, late_us == -50'001 ? decision_t::CERTIFIED : decision_t::REJECTED) << late_us;
  }
  robot_state_t nonsense = State();
  SayStateLate(0);
  nonsense.state[1] = std::numeric_limits<double>::quiet_NaN();
  nonsense.utime -= 400'000;
  SayState(nonsense);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED) << "what is no state says nothing";
}

TEST_F(RobotClockTest, TheClockOfWhoSeesTheObstaclesCountsToo) {
  SayStateLate(0);
  See(70'000);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  See(70'001);
  const decision_t decision = Ask();
  EXPECT_EQ(decision.cause, decision_t::CAUSE_NO_OBSTACLES);
  EXPECT_THAT(GetText(decision.message), HasSubstr("waits for OBSTACLES: their sender's clock is behind"));
  See(0);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
}

TEST_F(RobotClockTest, BothMayNotBeOffInOppositeDirections) {
  See(-30'000);
  SayStateLate(40'000);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  SayStateLate(40'001);
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
  See(-29'999);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  See(-30'000);
  ExpectNotArmed("the clocks of the robot and of the obstacles' sender are apart");
}

TEST_F(RobotClockTest, WithoutAClockErrorNoStampIsCompared) {
  config_.gate.max_clock_error_ms.reset();
  Begin();
  See(400'000);
  SayStateLate(473'000);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED) << "nothing moves";
}

TEST_F(RobotClockTest, WhatARobotThatHasFinishedOrAResetLeavesIsForgotten) {
  SayStateLate(90'000);
  robot_state_t last = State();
  last.mode = robot_state_t::FINISHED;
  last.utime -= 90'000;
  SayState(last);
  EXPECT_EQ(GetText(Ask().message), "rejected: waits for the robot's state");
}

}  // namespace forereach::robot_clock_test
