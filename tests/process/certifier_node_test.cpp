// The certifier's node on an in-memory bus with a simulated clock.
#include "certifier/process/certifier_node.h"

#include <map>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "certifier/gate/obstacle_message.h"
#include "tests/gate/small_task.h"

namespace forereach {
namespace {

using testing::ElementsAre;

class CertifierNodeTest : public testing::Test {
 protected:
  CertifierNodeTest() {
    config_.gate.queue = 4;
    config_.bus.decision = "MY_DECISION";  // a config may rename channels
    node_ = std::make_unique<CertifierNode>(config_, *bus_);
    bus_->Subscribe("MY_DECISION", [this](const Received& r) {
      decisions_.push_back(Decoded<decision_t>(r.bytes).value());
      order_ += 'd';
    });
    bus_->Subscribe("PLAN_CERTIFIED", [this](const Received& r) {
      certified_.push_back(Decoded<certified_plan_t>(r.bytes).value());
      order_ += 'c';
    });
    bus_->Subscribe("CERTIFIER_STATUS",
                    [this](const Received& r) { status_.push_back(Decoded<certifier_status_t>(r.bytes).value()); });
  }

  void Run() {
    bus_->Dispatch(0);  // candidates to the node
    node_->Tick(now_us_);
    bus_->Dispatch(0);  // its answers to us
  }
  std::vector<int> Causes() const {
    std::vector<int> causes;
    for (const decision_t& decision : decisions_) causes.push_back(decision.cause);
    return causes;
  }

  std::int64_t now_us_ = kNow;
  Config config_ = SmallTask();
  std::unique_ptr<Bus> bus_ = OpenBus("memq://", [this] { return now_us_; });
  std::unique_ptr<CertifierNode> node_;
  std::vector<decision_t> decisions_;
  std::vector<certified_plan_t> certified_;
  std::vector<certifier_status_t> status_;
  std::string order_;
};

TEST_F(CertifierNodeTest, ACertificateComesBeforeItsDecision) {
  bus_->Publish("PLAN_CANDIDATE", Candidate(1));
  Run();
  EXPECT_EQ(order_, "cd");
  ASSERT_EQ(decisions_.size(), 1u);
  EXPECT_EQ(decisions_[0].outcome, decision_t::CERTIFIED);
  EXPECT_EQ(decisions_[0].utime, kNow);
  EXPECT_GT(decisions_[0].elapsed_us, 0);
  ASSERT_EQ(certified_.size(), 1u);
  EXPECT_EQ(certified_[0].plan.plan_id, 1);
}

class RefusingBus final : public Bus {
 public:
  using Bus::Publish;
  void Subscribe(const std::string& channel, Handler handler) override { handlers_[channel] = std::move(handler); }
  bool Publish(const std::string&, Bytes) override { return false; }
  int Dispatch(int) override { return 0; }
  [[nodiscard]] std::int64_t dropped() const override { return 0; }
  void Deliver(const std::string& channel, Bytes bytes) { handlers_.at(channel)(Received{channel, bytes, kNow}); }

 private:
  std::map<std::string, Handler> handlers_;
};

TEST_F(CertifierNodeTest, WhatTheBusRefusesIsCounted) {
  RefusingBus bus;
  CertifierNode node(config_, bus);
  bus.Deliver("PLAN_CANDIDATE", Encode(Candidate(1)));
  node.Tick(kNow);
  testing::internal::CaptureStdout();
  node.Stop();
  EXPECT_THAT(testing::internal::GetCapturedStdout(), testing::HasSubstr("\"messages_not_sent\":3"))
      << "the certified plan, its decision, a heartbeat";
}

TEST_F(CertifierNodeTest, WhereMoreWaitThanItsQueueHoldsTheOldestAreAnsweredWithARejection) {
  for (int i = 1; i <= 7; ++i) bus_->Publish("PLAN_CANDIDATE", Candidate(i));
  Run();
  EXPECT_THAT(Causes(), ElementsAre(20, 20, 20, 0, 0, 0, 0)) << "20 is queue_full";
  std::vector<std::int64_t> ids, sequences;
  for (const decision_t& d : decisions_) ids.push_back(d.plan_id), sequences.push_back(d.sequence);
  EXPECT_THAT(ids, ElementsAre(1, 2, 3, 4, 5, 6, 7));
  EXPECT_THAT(sequences, ElementsAre(0, 1, 2, 3, 4, 5, 6));
  EXPECT_EQ(certified_.size(), 4u);

  bus_->Publish("PLAN_CANDIDATE", Candidate(8));
  Run();
  EXPECT_EQ(decisions_.back().outcome, decision_t::CERTIFIED) << "good again";
}

TEST_F(CertifierNodeTest, AFloodOfCandidatesIsAnsweredOnceEach) {
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 25; ++i) bus_->Publish("PLAN_CANDIDATE", Candidate(25 * round + i));
    Run();
  }
  std::map<std::int64_t, int> answers;
  for (const decision_t& decision : decisions_) ++answers[decision.plan_id];
  EXPECT_EQ(answers.size(), 500u);
  for (const auto& [plan_id, count] : answers) EXPECT_EQ(count, 1) << plan_id;
  EXPECT_EQ(certified_.size(), 80u) << "4 a round";
}

TEST_F(CertifierNodeTest, ObstaclesHoldFromTheirPlaceInTheQueueOn) {
  obstacles_t obstacles = ToMessage({Obstacle::Circle(Eigen::Vector2d(1, 0), 0.3)});
  obstacles.utime = kNow;
  bus_->Publish("PLAN_CANDIDATE", Candidate(1));
  bus_->Publish("OBSTACLES", obstacles);
  bus_->Publish("PLAN_CANDIDATE", Candidate(2));
  Run();
  EXPECT_THAT(Causes(), ElementsAre(0, 4)) << "4 is obstacle";
  EXPECT_NE(GetDigest(decisions_[0].obstacles_digest), GetDigest(decisions_[1].obstacles_digest));
}

TEST_F(CertifierNodeTest, ABadObstaclesMessageLeavesThoseInForce) {
  obstacles_t obstacles = ToMessage({});
  obstacles.utime = kNow;
  obstacles.num_obstacles = -1;
  bus_->Publish("OBSTACLES", obstacles);
  bus_->Publish("PLAN_CANDIDATE", Candidate(1, kAccelerationIntoTheCircle));
  Run();
  EXPECT_THAT(Causes(), ElementsAre(4));
  testing::internal::CaptureStdout();
  node_->Stop();
  EXPECT_THAT(testing::internal::GetCapturedStdout(), testing::HasSubstr("\"refused_obstacles\":1"));
}

TEST_F(CertifierNodeTest, OnlyCertifiedPlansArePassedOn) {
  bus_->Publish("PLAN_CANDIDATE", Candidate(1, kAccelerationIntoTheCircle));
  bus_->Publish("PLAN_CANDIDATE", Candidate(2, kAccelerationOutsideDomain));
  bus_->Publish("PLAN_CANDIDATE", obstacles_t{});
  bus_->Publish("PLAN_CANDIDATE", Candidate(3, 0, kNow - 1'000'000));
  Run();
  EXPECT_THAT(Causes(), ElementsAre(4, 2, 15, 10));
  EXPECT_TRUE(certified_.empty());
}

TEST_F(CertifierNodeTest, BeatsTwiceASecondWithItsCounts) {
  bus_->Publish("PLAN_CANDIDATE", Candidate(1));
  bus_->Publish("PLAN_CANDIDATE", Candidate(2, kAccelerationIntoTheCircle));
  for (int tick = 0; tick <= 1000; tick += 2) {
    now_us_ = kNow + 1000 * tick;
    Run();
  }
  ASSERT_EQ(status_.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(status_[i].sequence, static_cast<std::int64_t>(i));
    EXPECT_EQ(status_[i].utime, kNow + static_cast<std::int64_t>(i) * 500'000);
    EXPECT_EQ(status_[i].candidates, 2);
    EXPECT_EQ(status_[i].certified, 1);
    EXPECT_EQ(status_[i].abstained_safety, 1);
    EXPECT_GT(status_[i].elapsed_p50_us, 0);
    EXPECT_GE(status_[i].elapsed_p99_us, status_[i].elapsed_p50_us);
    EXPECT_EQ(GetDigest(status_[i].config_digest), config_.digest);
  }
}

}  // namespace
}  // namespace forereach
