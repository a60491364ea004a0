// The certifier's node: candidates, their answers and what else it sends, by an in-memory bus and a simulated clock.
#include "tests/test.h"

#include "forereach/certify/tube.h"
#include "lcmtypes/candidate_batch.h"
#include "tests/process/certifier_node_fixture.h"

namespace forereach::certifier_node_test {

TEST_F(CertifierNodeTest, ACertificateComesBeforeItsDecision) {
  bus_->Publish("PLAN_CANDIDATE", Candidate(1));
  Run();
  EXPECT_EQ(order_, "cd");
  EXPECT_FIELDS(Only(decisions_), (outcome, decision_t::CERTIFIED), (utime, kNow));
  EXPECT_GT(decisions_[0].elapsed_us, 0);
  EXPECT_EQ(Only(certified_).plan.plan_id, 1);
}

// Seen by the tube, which a repeated certificate leaves behind.
TEST_F(CertifierNodeTest, RepeatsItsLastCertificateWhileNothingWaits) {
  for (const bool keeps_warm : {false, true}) {
    config_.realtime.keep_warm = keeps_warm;
    Restart();
    const auto length = [&] { return node_->gate().tube().length(); };
    ASSERT_EQ(Ask().outcome, decision_t::CERTIFIED);
    const int whole = length();
    candidate_plan_t leaves = Candidate(next_plan_id_++, 0, now_us_);
    leaves.control[3][0] = 100;
    bus_->Publish("PLAN_CANDIDATE", leaves);
    Run();
    ASSERT_EQ(decisions_.back().outcome, decision_t::ABSTAIN_DOMAIN);
    EXPECT_EQ(length(), 3) << "the tick that answers repeats nothing";
    node_->Tick(now_us_ += 1000);
    EXPECT_EQ(length(), keeps_warm ? whole : 3);
    const std::size_t sent = decisions_.size() + certified_.size();
    bus_->Dispatch(0);
    EXPECT_EQ(decisions_.size() + certified_.size(), sent) << "a repetition is not sent";

    bus_->Publish("PLAN_CANDIDATE", leaves);  // refused, for its plan_id was used
    leaves.plan_id = next_plan_id_++;
    bus_->Publish("PLAN_CANDIDATE", leaves);
    Run();
    ASSERT_EQ(length(), 3);
    bus_->Publish("PLAN_CANDIDATE", leaves);
    node_->Tick(now_us_ += 1000);
    EXPECT_EQ(length(), 3) << "something waits";
    Run();
    node_->Tick(now_us_ += 1000);
    EXPECT_EQ(length(), keeps_warm ? whole : 3);
  }
}

TEST_F(CertifierNodeTest, RepeatsACertificateForATwentiethOfTheTimeAndASlowOneOnce) {
  config_.realtime.keep_warm = true;
  std::int64_t look_us = 0;  // which a look at the clock takes, and so a repetition
  clocks_.steady = [&] { return now_us_ += look_us; };
  Restart();
  ASSERT_EQ(Ask().outcome, decision_t::CERTIFIED);
  const int whole = node_->gate().tube().length();
  const auto repeats_at = [&](std::int64_t now_us) {
    candidate_plan_t leaves = Candidate(next_plan_id_++, 0, now_us_);
    leaves.control[3][0] = 100;
    bus_->Publish("PLAN_CANDIDATE", leaves);
    Run();
    EXPECT_EQ(node_->gate().tube().length(), 3);
    node_->Tick(now_us_ = now_us);
    return node_->gate().tube().length() == whole;
  };
  EXPECT_TRUE(repeats_at(now_us_));
  EXPECT_FALSE(repeats_at(now_us_ + 999));
  EXPECT_TRUE(repeats_at(now_us_ + 1));
  const auto repeats_in = [&](std::int64_t took_us) {
    look_us = took_us;
    node_->Tick(now_us_ += 1000);
    look_us = 0;
  };
  repeats_in(1000);
  EXPECT_FALSE(repeats_at(now_us_ + 19'999));
  EXPECT_TRUE(repeats_at(now_us_ + 1));
  repeats_in(1001);
  EXPECT_FALSE(repeats_at(now_us_ + 100'000)) << "never again";
  ASSERT_EQ(Ask().outcome, decision_t::CERTIFIED);
  EXPECT_TRUE(repeats_at(now_us_)) << "but of the next certificate";
}

TEST_F(CertifierNodeTest, AnswersWaitingCandidatesBeforeItEnds) {
  for (int id = 1; id <= 20; ++id) bus_->Publish("PLAN_CANDIDATE", Candidate(id));
  bus_->Dispatch(0);
  testing::internal::CaptureStdout();
  node_->Stop();
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("\"candidates\":20"));
  bus_->Dispatch(0);
  EXPECT_EQ(decisions_.size(), 20u);
}

TEST_F(CertifierNodeTest, AnswersAWaitingCandidateBeforeItsStart) {
  for (int id = 1; id <= 12; ++id) {
    candidate_plan_t candidate = Candidate(id);
    if (id == 1) candidate.start_utime = now_us_ + 4999;  // gate.decision_budget_ms is 5
    if (id == 2) candidate.start_utime = now_us_ + 5000;
    bus_->Publish("PLAN_CANDIDATE", candidate);
  }
  Run();
  ASSERT_GE(decisions_.size(), 2u);
  EXPECT_EQ(decisions_[0].plan_id, 12) << "the newest first";
  EXPECT_EQ(decisions_[1].plan_id, 1) << "then what would come too late";
  EXPECT_EQ(decisions_[1].outcome, decision_t::ABSTAIN_DEADLINE);
  for (int i = 0; i < 3; ++i) Run();
  ASSERT_EQ(decisions_.size(), 12u);
  EXPECT_FIELDS(decisions_.back(), (plan_id, 2), (outcome, decision_t::CERTIFIED));
}

// Each answer takes its time, and those of a flood together longer than the few that may wait have.
TEST_F(CertifierNodeTest, AnswersEachCandidateOfAFloodBeforeItsStart) {
  SlowDown(50);
  Restart();
  constexpr int kFlood = 600;
  for (int id = 1; id <= kFlood; ++id) {
    candidate_plan_t candidate = Candidate(id);
    candidate.start_utime = now_us_ + (id <= kFlood - CertifierNode::kAtOnce - config_.gate.queue ? 400'000 : 20'000);
    bus_->Publish("PLAN_CANDIDATE", candidate);
  }
  Run();
  Run();
  ASSERT_EQ(decisions_.size(), static_cast<std::size_t>(kFlood));
  const std::vector<int> causes = Causes();
  EXPECT_GT(now_us_, kNow + 25'000) << "else nothing was at stake";
  EXPECT_EQ(std::ranges::count(causes, decision_t::CAUSE_TOO_LATE), 0);
}

class RefusingBus final : public Bus {
 public:
  using Bus::Publish;
  void Subscribe(const std::string& channel, Handler handler) override { handlers_[channel] = std::move(handler); }
  bool Publish(const std::string&, Bytes) override { return false; }
  int Dispatch(int) override { return 0; }
  [[nodiscard]] std::int64_t dropped() const override { return 0; }
  void Deliver(const std::string& channel, Bytes bytes) {
    handlers_.at(channel)(Received{channel, bytes, kNow, bytes});
  }

 private:
  std::map<std::string, Handler> handlers_;
};

TEST_F(CertifierNodeTest, WhatTheBusRefusesIsCounted) {
  RefusingBus bus;
  CertifierNode node(config_, bus, clocks_);
  bus.Deliver("PLAN_CANDIDATE", Encode(Candidate(1)));
  node.Tick(kNow);
  testing::internal::CaptureStdout();
  node.Stop();
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("\"messages_not_sent\":3"))
      << "the certified plan, its decision, a heartbeat";
}

TEST_F(CertifierNodeTest, WhereMoreWaitThanItsQueueHoldsTheOldestAreAnsweredWithARejection) {
  for (int i = 1; i <= 7; ++i) bus_->Publish("PLAN_CANDIDATE", Candidate(i));
  Run();
  EXPECT_THAT(Causes(), ElementsAre(0, 0, 0, 0, 0, 0, 0)) << "eight are decided on at once";
  decisions_.clear();
  certified_.clear();
  for (int i = 11; i <= 25; ++i) bus_->Publish("PLAN_CANDIDATE", Candidate(i));
  Run();
  EXPECT_THAT(Causes(), ElementsAre(0, 0, 0, 0, 0, 0, 0, 0, 20, 20, 20)) << "20 is queue_full";
  EXPECT_TRUE(node_->busy()) << "four still wait";
  Run();
  EXPECT_FALSE(node_->busy());
  std::vector<std::int64_t> ids, sequences;
  for (const decision_t& d : decisions_) ids.push_back(d.plan_id), sequences.push_back(d.sequence);
  EXPECT_THAT(ids, ElementsAre(25, 24, 23, 22, 21, 20, 19, 18, 11, 12, 13, 17, 16, 15, 14)) << "the newest first";
  EXPECT_THAT(sequences, ElementsAre(7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21));
  EXPECT_EQ(certified_.size(), 12u);

  bus_->Publish("PLAN_CANDIDATE", Candidate(28));
  Run();
  EXPECT_EQ(decisions_.back().outcome, decision_t::CERTIFIED) << "good again";
}

TEST_F(CertifierNodeTest, AFloodOfCandidatesIsAnsweredOnceEach) {
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 25; ++i) bus_->Publish("PLAN_CANDIDATE", Candidate(25 * round + i));
    Run();
    Run();
  }
  std::map<std::int64_t, int> answers;
  for (const decision_t& decision : decisions_) ++answers[decision.plan_id];
  EXPECT_EQ(answers.size(), 500u);
  for (const auto& [plan_id, count] : answers) EXPECT_EQ(count, 1) << plan_id;
  EXPECT_EQ(certified_.size(), 20u * 12) << "8 at once, and the 4 that may wait";
}

TEST_F(CertifierNodeTest, OnlyCertifiedPlansArePassedOn) {
  bus_->Publish("PLAN_CANDIDATE", Candidate(1, kAccelerationIntoTheCircle));
  bus_->Publish("PLAN_CANDIDATE", Candidate(2, kAccelerationOutsideDomain));
  bus_->Publish("PLAN_CANDIDATE", obstacles_t{});
  bus_->Publish("PLAN_CANDIDATE", Candidate(3, 0, kNow - 1'000'000));
  Run();
  EXPECT_THAT(Causes(), ElementsAre(10, 15, 2, 4));
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
    const bool is_first = i == 0;  // it comes before anything is decided
    EXPECT_FIELDS(status_[i], (candidates, is_first ? 0 : 2), (by_outcome[decision_t::CERTIFIED], is_first ? 0 : 1),
                  (by_cause[decision_t::CAUSE_OBSTACLE], is_first ? 0 : 1), (level, certifier_status_t::OK));
    EXPECT_EQ(status_[i].elapsed_p50_us > 0, !is_first);
    EXPECT_GE(status_[i].elapsed_p99_us, status_[i].elapsed_p50_us);
    EXPECT_EQ(GetDigest(status_[i].config_digest), config_.grounds.config);
  }
}

// A batch may take as long as many candidates.
TEST_F(CertifierNodeTest, LooksAtTheBusAfterEachBatch) {
  for (int id = 1; id <= 3; ++id) {
    candidate_batch_t batch{};
    ASSERT_TRUE(Append(batch, Candidate(10 * id, kAccelerationIntoTheCircle)));
    ASSERT_TRUE(Append(batch, Candidate(10 * id + 1)));
    bus_->Publish("PLAN_CANDIDATE", batch);
  }
  for (int turn = 1; turn <= 3; ++turn) {
    Run();
    ASSERT_EQ(std::ssize(decisions_), turn);
    ASSERT_EQ(std::ssize(certified_), turn);
    EXPECT_EQ(decisions_.back().plan_id, 10 * (4 - turn) + 1) << "the newest first";
    EXPECT_EQ(certified_.back().plan.plan_id, decisions_.back().plan_id);
  }
  EXPECT_EQ(order_, "cdcdcd");
}

}  // namespace forereach::certifier_node_test
