// Where a certifier's obstacles come from, and what it says while they are unknown.
#include "tests/test.h"

#include "tests/process/certifier_node_fixture.h"

namespace forereach::obstacles_node_test {

TEST_F(ObstaclesNodeTest, CertifiesNothingBeforeObstaclesAreHeardNorAfterARestart) {
  for (int start = 0; start < 2; ++start) {
    ExpectUnknown("none has been heard yet");
    EXPECT_TRUE(certified_.empty());
    Say(kOnTheWay);
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_OBSTACLE);
    Say({});
    EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
    certified_.clear();
    Say(kOnTheWay);
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_OBSTACLE);
    Restart();  // as after SIGKILL: it forgets
  }
}

TEST_F(ObstaclesNodeTest, SilenceMakesObstaclesUnknownNotAbsent) {
  Say({});
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  now_us_ += 1'000'000;
  Run();
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED) << "just in time";
  now_us_ += 1;
  ExpectUnknown("the last message is ");
  now_us_ += 3'600'000'000;
  ExpectUnknown("the last message is ");
  Say({});
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED) << "nobody has to reset it";
}

// What is decided on late in a tick is held to the time of its decision.
TEST_F(ObstaclesNodeTest, TheTimeoutCountsWithinATick) {
  SlowDown(10);
  Restart();
  Say({});
  Run();
  now_us_ += 999'800;
  for (int id = 1; id <= 8; ++id) bus_->Publish("PLAN_CANDIDATE", Candidate(id, kAccelerationThatCertifies, now_us_));
  Run();
  ASSERT_EQ(decisions_.size(), 8u);
  EXPECT_FIELDS(decisions_, (front().outcome, decision_t::CERTIFIED), (back().cause, decision_t::CAUSE_NO_OBSTACLES));
}

TEST_F(ObstaclesNodeTest, ARefusedOrMissingMessageMakesObstaclesUnknown) {
  Say({});
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  obstacles_t bad = Seen(kOnTheWay);
  bad.num_obstacles = -1;
  bus_->Publish("OBSTACLES", bad);
  ExpectUnknown("the last message was refused: obstacles: -1, must be 0 to 64");
  Say({});
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  static_cast<void>(Seen({}));  // lost
  Say({});
  ExpectUnknown("sequence 4 came out of order");
  EXPECT_FIELDS(status_.back(), (obstacles_lost, 1), (messages_refused, 1));
  Say({});
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
}

TEST_F(ObstaclesNodeTest, ObstaclesAreTakenBeforeCandidatesThatWait) {
  bus_->Publish("PLAN_CANDIDATE", Candidate(1));
  Say(kOnTheWay);
  bus_->Publish("PLAN_CANDIDATE", Candidate(2));
  Run();
  EXPECT_THAT(Causes(), ElementsAre(4, 4)) << "4 is obstacle";
  EXPECT_EQ(GetDigest(decisions_[0].obstacles_digest), GetDigest(decisions_[1].obstacles_digest));
}

TEST_F(ObstaclesNodeTest, NamesEveryMissingPrecondition) {
  config_.gate.needs_robot_state = true;
  Restart();
  const decision_t decision = Ask();
  EXPECT_EQ(decision.cause, decision_t::CAUSE_NOT_ARMED);
  EXPECT_EQ(GetText(decision.message),
            "rejected: waits for the robot's state; waits for OBSTACLES: none has been heard yet");
  EXPECT_EQ(GetText(status_.back().message),
            "waits for the robot's state; waits for OBSTACLES: none has been heard yet");
  Say({});
  EXPECT_EQ(GetText(Ask().message), "rejected: waits for the robot's state");
}

TEST_F(ObstaclesNodeTest, RefusesObstaclesOfTheBusWhereTheTaskHasThemAllAndSaysSo) {
  config_.gate.obstacles = ObstaclesSource::kTask;
  Restart();
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  EXPECT_EQ(GetText(status_.back().message), "gate.obstacles is task: the 1 of the task file are all there are");
  EXPECT_EQ(status_.back().obstacles_source, certifier_status_t::OBSTACLES_TASK);
  Say(kOnTheWay);
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  now_us_ += CertifierNode::kHeartbeatUs;
  Run();
  EXPECT_FIELDS(status_.back(), (level, certifier_status_t::OK), (messages_refused, 1));
  EXPECT_THAT(GetText(status_.back().message), HasSubstr("; OBSTACLES is refused"));
}

TEST_F(ObstaclesNodeTest, RefusesATaskThatDoesNotSayWhereObstaclesComeFrom) {
  config_.gate.obstacles = ObstaclesSource::kUnsaid;
  config_.path = "task.yaml";
  EXPECT_THAT([&] { CertifierNode node(config_, *bus_, clocks_); },
              ThrowsMessage<ConfigError>(StartsWith("task.yaml: gate.obstacles: missing. `bus`: ")));
}

TEST_F(ObstaclesNodeTest, OneThatWasStoppedSaysSoOfTheObstaclesThatItMissed) {
  Say({});
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED);
  now_us_ += 1'990'000;
  EXPECT_THAT(GetText(Ask().message),
              HasSubstr("waits for OBSTACLES: the last message is 1990 ms old, at most 1000 ms are allowed: this "
                        "certifier itself did not run for 1990 ms"));
  Say({});
  EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED) << "what was queued arms it again";
  for (int i = 0; i < 12; ++i) {
    now_us_ += 90'000;
    Run();
  }
  EXPECT_THAT(GetText(Ask().message), EndsWith("at most 1000 ms are allowed")) << "now it is the sender";
}

}  // namespace forereach::obstacles_node_test
