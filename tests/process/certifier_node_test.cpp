// The certifier's node on an in-memory bus with a simulated clock.
#include "certifier/process/certifier_node.h"

#include <regex>

#include <unistd.h>

#include "tests/test.h"

#include "clients/supervised.h"
#include "forereach/dynamics/models/named_residuals.h"
#include "lcmtypes/candidate_batch.h"
#include "simulator/sim_node.h"
#include "tests/certifier/small_task.h"
#include "tests/keys.h"
#include "tests/paths.h"

namespace forereach::certifier_node_test {

struct CertifierNodeTest : testing::Test {
  CertifierNodeTest() {
    config_.gate.queue = 4;
    config_.bus.decision = "MY_DECISION";  // a config may rename channels
    Restart();
  }

  // A new bus too: who subscribed to the old one has to again.
  void Restart() {
    node_.reset();
    bus_ = OpenBus("memq://", clock_);
    node_ = std::make_unique<CertifierNode>(config_, *bus_, clocks_);
    bus_->Subscribe("MY_DECISION", [this](const Received& r) {
      decisions_.push_back(Decoded<decision_t>(r.bytes).value());
      order_ += 'd';
    });
    bus_->Subscribe("PLAN_CERTIFIED", [this](const Received& r) {
      certified_.push_back(Decoded<certified_plan_t>(r.bytes).value());
      order_ += 'c';
    });
    Hear(*bus_, "CERTIFIER_STATUS", status_);
    Hear(*bus_, "FAULT", faults_);
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
  decision_t Ask(double acceleration = kAccelerationThatCertifies) {
    bus_->Publish("PLAN_CANDIDATE", Candidate(next_plan_id_++, acceleration, now_us_));
    Run();
    return decisions_.back();
  }
  // Each look at a clock takes so long, from the next start on.
  void SlowDown(std::int64_t us) {
    const Clock slow = [this, us] { return now_us_ += us; };
    clocks_ = {slow, slow};
  }

  std::int64_t now_us_ = kNow;
  Config config_ = SmallTask();
  const Clock clock_ = [this] { return now_us_; };
  Clocks clocks_{clock_, clock_};
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<CertifierNode> node_;
  std::vector<decision_t> decisions_;
  std::vector<certified_plan_t> certified_;
  std::vector<certifier_status_t> status_;
  std::vector<fault_t> faults_;
  std::string order_;
  std::int64_t next_plan_id_ = 1;
};

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

// What comes after a decision: an advice, where the task asks for it, or a repair, where the candidate does.
struct AdvisingCertifierTest : CertifierNodeTest {
  AdvisingCertifierTest() { Begin(true); }

  void Begin(bool advises) {
    config_.gate.advises = advises;
    Restart();
    bus_->Subscribe("PLAN_ADVICE", [this](const Received& r) {
      advices_.push_back(Decoded<advice_t>(r.bytes).value());
      order_ += 'a';
    });
  }
  void Ask(int id, double acceleration, bool repair = false) {
    candidate_plan_t candidate = Candidate(id, acceleration);
    candidate.repair = repair;
    bus_->Publish("PLAN_CANDIDATE", candidate);
  }

  std::vector<advice_t> advices_;
};

struct SearchingCertifierTest : AdvisingCertifierTest, testing::WithParamInterface<bool> {
  SearchingCertifierTest() { Begin(); }
  void Begin() { AdvisingCertifierTest::Begin(!GetParam()); }
  void AskForSearch(int id) { Ask(id, kAccelerationIntoTheCircle, GetParam()); }
};

INSTANTIATE_TEST_SUITE_P(ForAn, SearchingCertifierTest, testing::Bool(),
                         [](const auto& repair) { return repair.param ? "Repair" : "Advice"; });

TEST_F(AdvisingCertifierTest, AnAdviceComesAfterItsDecisionAndNotInItsTick) {
  Ask(1, kAccelerationIntoTheCircle);
  Run();
  EXPECT_EQ(order_, "d");
  EXPECT_TRUE(node_->busy());
  Run();
  EXPECT_EQ(order_, "da");
  EXPECT_FALSE(node_->busy());
  Run();
  EXPECT_FIELDS(Only(advices_), (plan_id, 1), (sequence, 0), (utime, kNow));
  EXPECT_EQ(GetDigest(advices_[0].plan_digest), GetDigest(decisions_[0].plan_digest));
  Ask(2, kAccelerationOutsideDomain);
  Run();
  Run();
  ASSERT_EQ(advices_.size(), 2u);
  EXPECT_EQ(advices_[1].sequence, 1);
}

TEST_F(AdvisingCertifierTest, GivesNoAdviceUnlessTheTaskAsksForIt) {
  Begin(false);
  Ask(1, kAccelerationIntoTheCircle);
  Run();
  EXPECT_FALSE(node_->busy());
  Run();
  EXPECT_EQ(order_, "d");
}

TEST_F(AdvisingCertifierTest, GivesNoAdviceOnACertificate) {
  Ask(1, kAccelerationThatCertifies);
  Run();
  EXPECT_FALSE(node_->busy());
  Run();
  EXPECT_EQ(order_, "cd");
}

// What waits is answered first, and who has asked before has gone on.
TEST_F(AdvisingCertifierTest, DropsItsAdviceForANewerCandidate) {
  Ask(1, kAccelerationIntoTheCircle);
  Run();
  Ask(2, kAccelerationThatCertifies);
  Run();
  Run();
  EXPECT_EQ(order_, "dcd");
  for (int id = 3; id <= 12; ++id) Ask(id, kAccelerationIntoTheCircle);
  for (int i = 0; i < 8; ++i) Run();
  EXPECT_EQ(std::ranges::count(order_, 'a'), 1);
  EXPECT_EQ(order_.back(), 'a') << "of many that wait, after all of them, and on one";
}

TEST_P(SearchingCertifierTest, DropsItsSearchWhenACandidateArrives) {
  AskForSearch(1);
  Run();
  Ask(2, kAccelerationThatCertifies);  // arrives during the search
  node_->Tick(now_us_);
  Run();
  EXPECT_EQ(order_, "dcd");
  EXPECT_TRUE(advices_.empty());
}

TEST_P(SearchingCertifierTest, ASearchTakesNoLongerThanADecisionMay) {
  SlowDown(1000);
  Begin();
  AskForSearch(1);
  Run();
  const std::int64_t before = now_us_;
  Run();
  EXPECT_TRUE(GetParam() || advices_.empty());
  EXPECT_LT(now_us_, before + 50'000);
  EXPECT_FALSE(node_->busy()) << "and is not tried again";
}

TEST_F(AdvisingCertifierTest, DropsItsAdviceWhenTheObstaclesChange) {
  config_.gate.obstacles = ObstaclesSource::kBus;
  config_.gate.obstacles_lost_ms = kNeverLost;
  Begin(true);
  const auto see = [&](double x, int sequence) {
    bus_->Publish("OBSTACLES", Sighted({Obstacle::Circle(Eigen::Vector2d(x, 0), 0.5)}, now_us_, sequence));
  };
  see(3.5, 0);
  Ask(1, kAccelerationIntoTheCircle);
  Run();
  ASSERT_EQ(order_, "d");
  see(4, 1);
  Run();
  Run();
  EXPECT_EQ(order_, "d");
}

struct RepairingCertifierTest : AdvisingCertifierTest {
  RepairingCertifierTest() { Begin(false); }
  void AskForRepair(int id, double acceleration) { Ask(id, acceleration, true); }
};

TEST_F(RepairingCertifierTest, AProposalComesAfterItsDecisionAndIsCertifiedWhenItIsSent) {
  AskForRepair(1, kAccelerationIntoTheCircle);
  Run();
  EXPECT_EQ(order_, "d");
  EXPECT_TRUE(node_->busy());
  Run();
  EXPECT_EQ(order_, "da");
  EXPECT_FALSE(node_->busy());
  EXPECT_EQ(GetDigest(Only(advices_).plan_digest), GetDigest(decisions_[0].plan_digest));
  EXPECT_NE(advices_[0].changed, 0);
  EXPECT_TRUE(certified_.empty()) << "it is no certificate";

  candidate_plan_t sent = advices_[0].proposal;
  sent.utime = kNow;
  sent.plan_id = 2;
  bus_->Publish("PLAN_CANDIDATE", sent);
  Run();
  EXPECT_EQ(Encode(Only(certified_).plan), Encode(sent)) << "byte for byte";
}

TEST_F(RepairingCertifierTest, SaysThatItFoundNone) {
  config_.obstacles = {Obstacle::Circle(Eigen::Vector2d(0, 0), 1)};
  Begin(false);
  AskForRepair(1, kAccelerationThatCertifies);
  Run();
  Run();
  EXPECT_EQ(std::tuple(Only(advices_).changed, advices_[0].num_changes), std::tuple(0, 0));
  Begin(true);  // a task that gives advice gives it then
  AskForRepair(1, kAccelerationThatCertifies);
  Run();
  Run();
  ASSERT_EQ(advices_.size(), 2u);
  EXPECT_EQ(std::tuple(advices_[1].changed, advices_[1].num_changes), std::tuple(0, 1));
}

// However many ask: one search at a time, on the newest, and none while anything waits.
TEST_F(RepairingCertifierTest, AFloodOfRequestsGetsOneSearchAfterAllDecisions) {
  for (int id = 1; id <= 40; ++id) AskForRepair(id, kAccelerationIntoTheCircle);
  for (int i = 0; i < 12; ++i) Run();
  EXPECT_EQ(decisions_.size(), 40u);
  ASSERT_EQ(advices_.size(), 1u);
  EXPECT_EQ(order_.back(), 'a');
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

// ---- Where the obstacles come from.

struct ObstaclesNodeTest : CertifierNodeTest {
  ObstaclesNodeTest() {
    config_.gate.obstacles = ObstaclesSource::kBus;
    config_.gate.obstacles_lost_ms = kNeverLost;
    Restart();
  }

  obstacles_t Seen(const std::vector<Obstacle>& obstacles) { return Sighted(obstacles, now_us_, next_sequence_++); }
  void Say(const std::vector<Obstacle>& obstacles) { bus_->Publish("OBSTACLES", Seen(obstacles)); }
  // The decision and the heartbeat say so.
  void ExpectUnknown(const std::string& why) {
    const decision_t decision = Ask();
    EXPECT_FIELDS(decision, (outcome, decision_t::ABSTAIN_OBSTACLES), (cause, decision_t::CAUSE_NO_OBSTACLES));
    EXPECT_THAT(GetText(decision.message), HasSubstr("abstained: waits for OBSTACLES: " + why));
    now_us_ += CertifierNode::kHeartbeatUs;
    Run();
    EXPECT_FIELDS(status_.back(), (level, certifier_status_t::STALE), (state, certifier_status_t::DISARMED),
                  (obstacles_known, 0));
    EXPECT_THAT(GetText(status_.back().message), HasSubstr("waits for OBSTACLES: " + why));
  }

  const std::vector<Obstacle> kOnTheWay{Obstacle::Circle(Eigen::Vector2d(1, 0), 0.3)};
  std::int64_t next_sequence_ = 0;
};

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

// ---- Two certifiers on one bus.

struct TwoCertifiersTest : ObstaclesNodeTest {
  // Each hears the robot's obstacles, and both are run in turn, unless paused.
  void Start(std::size_t i) {
    nodes_[i] = std::make_unique<CertifierNode>(config_, buses_[i], clocks_, Charge::kListenUs);
    nodes_[i]->Tick(now_us_);
  }
  TwoCertifiersTest() {
    node_.reset();
    for (SharedBus& bus : buses_) bus.others = &buses_, bus.clock = clock_;
    listener_.others = &buses_;
  }
  void StartInTurn() {
    for (const std::size_t i : {0, 1}) Start(i), Pass(1'000'000);
  }

  void Pass(std::int64_t us) {
    for (const std::int64_t end = now_us_ + us; now_us_ < end; now_us_ += 2000) {
      if (now_us_ >= next_seen_us_) {
        next_seen_us_ = now_us_ + 200'000;
        listener_.Publish("OBSTACLES", Seen(says_));
      }
      for (std::size_t i = 0; i < 2; ++i) {
        if (!nodes_[i] || paused_[i]) continue;
        buses_[i].Dispatch(0);
        nodes_[i]->Tick(now_us_);
      }
    }
  }
  // Answers that come to one candidate, by both.
  std::vector<decision_t> Answers() {
    const std::int64_t id = next_plan_id_++;
    listener_.Publish("PLAN_CANDIDATE", Candidate(id, kAccelerationThatCertifies, now_us_));
    Pass(400'000);
    std::vector<decision_t> answers;
    for (SharedBus& bus : buses_)
      for (const auto& [channel, bytes] : bus.sent)
        if (const auto decision = Decoded<decision_t>(bytes); decision && decision->plan_id == id)
          answers.push_back(*decision);
    return answers;
  }
  certifier_status_t Status(std::size_t i) const {
    certifier_status_t status{};
    for (const auto& [channel, bytes] : buses_[i].sent)
      if (const auto decoded = Decoded<certifier_status_t>(bytes)) status = *decoded;
    return status;
  }
  std::array<Charge::State, 2> States() const { return {nodes_[0]->charge().state(), nodes_[1]->charge().state()}; }

  // What one says reaches all, itself too, as multicast does.
  struct SharedBus final : Bus {
    using Bus::Publish;
    void Subscribe(const std::string& channel, Handler handler) override { handlers[channel] = std::move(handler); }
    bool Publish(const std::string& channel, Bytes bytes) override {
      sent.push_back({channel, {bytes.begin(), bytes.end()}});
      for (SharedBus& bus : *others) bus.arrived.push_back(sent.back());
      return true;
    }
    int Dispatch(int) override {
      const auto now = std::exchange(arrived, {});
      for (const auto& [channel, bytes] : now)
        if (handlers.contains(channel)) handlers[channel](Received{channel, bytes, clock(), bytes});
      return static_cast<int>(now.size());
    }
    [[nodiscard]] std::int64_t dropped() const override { return 0; }

    std::array<SharedBus, 2>* others = nullptr;
    std::map<std::string, Handler> handlers;
    std::vector<std::pair<std::string, std::vector<std::uint8_t>>> sent, arrived;
    Clock clock;
  };

  std::array<SharedBus, 2> buses_;
  SharedBus listener_;  // sends only
  std::array<std::unique_ptr<CertifierNode>, 2> nodes_;
  std::array<bool, 2> paused_{};
  std::int64_t next_seen_us_ = 0;
  std::vector<Obstacle> says_;
};

using Charged = std::array<Charge::State, 2>;
constexpr auto kInCharge = Charge::State::kInCharge, kStandingBy = Charge::State::kStandingBy;

TEST_F(TwoCertifiersTest, TheLaterOneRefusesToArmAndAnswersNobody) {
  StartInTurn();
  EXPECT_EQ(States(), (Charged{kInCharge, kStandingBy}));
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(Only(Answers()).outcome, decision_t::CERTIFIED);
  }
  for (const auto& [channel, bytes] : buses_[1].sent) EXPECT_EQ(channel, "CERTIFIER_STATUS");
  Pass(600'000);
  const certifier_status_t first = Status(0), second = Status(1);
  EXPECT_FIELDS(first, (level, certifier_status_t::OK), (other_instance, second.instance));
  EXPECT_THAT(GetText(first.message), HasSubstr("another certifier"));
  EXPECT_FIELDS(second, (level, certifier_status_t::STALE), (state, certifier_status_t::STANDBY),
                (other_instance, first.instance), (candidates, 0), (by_cause[decision_t::CAUSE_SECOND_CERTIFIER], 5));
  EXPECT_THAT(GetText(second.message), HasSubstr("is in charge on this bus: this one decides nothing"));
  EXPECT_LT(first.started_utime, second.started_utime);
}

// Whichever begins first: candidates get the answer of the one that certifies, and a shadow is alone in charge at most.
TEST_F(TwoCertifiersTest, AShadowGivesWayToACertifierAndHoldsUpNone) {
  for (SharedBus& bus : buses_) bus.clock = clock_;
  config_.gate.shadow = true;
  Start(0);
  Pass(1'000'000);
  auto answers = Answers();
  EXPECT_EQ(Only(answers).cause, decision_t::CAUSE_SHADOW);
  config_.gate.shadow = false;
  Start(1);
  Pass(Charge::kListenUs + 100'000);
  EXPECT_EQ(States(), (Charged{kStandingBy, kInCharge}));
  for (int i = 0; i < 3; ++i) {
    answers = Answers();
    ASSERT_EQ(answers.size(), 1u) << "one decision on each candidate";
    EXPECT_EQ(answers[0].outcome, decision_t::CERTIFIED);
  }
  for (const auto& [channel, bytes] : buses_[0].sent) EXPECT_NE(channel, "PLAN_CERTIFIED");
  EXPECT_EQ(Status(0).shadow, 1);
  config_.gate.shadow = true;
  Start(0);  // again, and later
  Pass(1'000'000);
  EXPECT_EQ(States(), (Charged{kStandingBy, kInCharge}));
  nodes_[1].reset();
  Pass(Charge::kSilenceUs + 2 * Charge::kListenUs);
  answers = Answers();
  EXPECT_EQ(Only(answers).cause, decision_t::CAUSE_SHADOW);
}

TEST_F(TwoCertifiersTest, OfTwoThatStartTogetherOneTakesChargeAndCandidatesWaitForIt) {
  Start(0);
  Start(1);
  EXPECT_EQ(Only(Answers()).cause, decision_t::CAUSE_NO_OBSTACLES) << "it has not listened to anything before";
  const bool first = Status(0).instance < Status(1).instance;
  EXPECT_EQ(States(), first ? (Charged{kInCharge, kStandingBy}) : (Charged{kStandingBy, kInCharge}));
  EXPECT_EQ(Answers().size(), 1u);
}

TEST_F(TwoCertifiersTest, TheLaterOneTakesOverOnceTheFirstIsSilentAndItsOwnWorldIsKnown) {
  says_ = kOnTheWay;
  StartInTurn();
  EXPECT_EQ(Answers().at(0).cause, decision_t::CAUSE_OBSTACLE);
  nodes_[0].reset();
  Pass(Charge::kSilenceUs - 500'000);
  EXPECT_TRUE(Answers().empty()) << "nobody is in charge";
  Pass(1'000'000);
  EXPECT_EQ(nodes_[1]->charge().state(), kInCharge);
  EXPECT_EQ(Status(1).level, certifier_status_t::OK);
  EXPECT_EQ(Answers().at(0).cause, decision_t::CAUSE_OBSTACLE);
  for (SharedBus& bus : buses_)
    for (const auto& [channel, bytes] : bus.sent) EXPECT_NE(channel, "PLAN_CERTIFIED");
}

TEST_F(TwoCertifiersTest, OneThatTakesOverWithoutObstaclesCertifiesNothing) {
  StartInTurn();
  nodes_[0].reset();
  next_seen_us_ = INT64_MAX;  // who sees them has died too
  Pass(3'000'000);
  EXPECT_EQ(nodes_[1]->charge().state(), kInCharge);
  EXPECT_EQ(Answers().at(0).cause, decision_t::CAUSE_NO_OBSTACLES);
}

TEST_F(TwoCertifiersTest, TheFirstGivesWayAfterAPauseInWhichTheSecondTookOver) {
  StartInTurn();
  paused_[0] = true;
  Pass(4'000'000);
  EXPECT_EQ(nodes_[1]->charge().state(), kInCharge);
  paused_[0] = false;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(Answers().size(), 1u);
  EXPECT_EQ(States(), (Charged{kStandingBy, kInCharge}));
  EXPECT_EQ(Status(0).observations, static_cast<std::int64_t>(config_.problem->transitions.size()));
}

TEST_F(TwoCertifiersTest, APauseThatIsShorterThanTheTakeoverChangesNothing) {
  StartInTurn();
  for (const std::int64_t pause : {1'400'000, 1'600'000}) {
    paused_[0] = true;
    Pass(pause);
    paused_[0] = false;
    Pass(1'500'000);
    EXPECT_EQ(States(), (Charged{kInCharge, kStandingBy})) << pause;
    EXPECT_EQ(Answers().size(), 1u);
  }
}

// Where heartbeats are lost both may be in charge; the later one gives way, and forgets what it was certifying on.
TEST_F(TwoCertifiersTest, BothInChargeTheLaterGivesWay) {
  Start(0);
  Pass(1'000'000);
  std::array<SharedBus, 2> elsewhere;  // a cable is out
  for (SharedBus& bus : elsewhere) bus.others = &elsewhere, bus.clock = clock_;
  Start(1);
  buses_[0].others = &elsewhere;
  for (int i = 0; i < 500; ++i) {
    now_us_ += 2000;
    nodes_[1]->Tick(now_us_);
  }
  ASSERT_EQ(nodes_[1]->charge().state(), kInCharge);
  buses_[0].others = &buses_;
  Pass(700'000);
  EXPECT_EQ(States(), (Charged{kInCharge, kStandingBy}));
  EXPECT_EQ(Answers().size(), 1u);
  EXPECT_EQ(Status(1).candidates, 0);
}

TEST_F(TwoCertifiersTest, AFaultThatTheFirstHadLatchedIsTakenOver) {
  StartInTurn();
  listener_.Publish("TRANSITION", AtRest(now_us_, 1));
  Pass(700'000);
  ASSERT_EQ(Status(0).fault, fault_t::DECLARATION_FALSIFIED);
  EXPECT_EQ(Status(1).fault, 0);
  nodes_[0].reset();
  Pass(3'000'000);
  EXPECT_FIELDS(Status(1), (state, certifier_status_t::FAULT), (fault, fault_t::DECLARATION_FALSIFIED));
  EXPECT_THAT(GetText(Status(1).message), HasSubstr("latched by the certifier that was in charge before"));
  EXPECT_EQ(Answers().at(0).cause, decision_t::CAUSE_FAULT);
}

// After a reset the heartbeat of the first shows no fault any more, and still that the declaration is false.
TEST_F(TwoCertifiersTest, ADeclarationThatTheFirstHasSeenContradictedStaysFalse) {
  StartInTurn();
  listener_.Publish("TRANSITION", AtRest(now_us_, 1));
  Pass(700'000);
  const auto reset = [this] {
    listener_.Publish("COMMAND", ResetAt(now_us_));
    Pass(700'000);
  };
  reset();
  ASSERT_EQ(Status(0).fault, 0);
  nodes_[0].reset();
  Pass(3'000'000);
  EXPECT_EQ(Status(1).fault, fault_t::DECLARATION_FALSIFIED);
  reset();
  EXPECT_EQ(Status(1).fault, 0);
  EXPECT_EQ(Answers().at(0).outcome, decision_t::ABSTAIN_FALSIFIED);
}

TEST_F(TwoCertifiersTest, AFaultThatNoHeartbeatHasShownIsTakenOver) {
  StartInTurn();
  nodes_[0].reset();
  listener_.Publish("FAULT", fault_t{.utime = now_us_, .cause = fault_t::CLOCK_JUMP});
  Pass(3'000'000);
  EXPECT_EQ(Status(1).fault, fault_t::CLOCK_JUMP);
}

TEST_F(TwoCertifiersTest, IgnoresARecordedHeartbeat) {
  Start(0);
  Pass(1'000'000);
  certifier_status_t recorded = Status(0);
  recorded.instance = 7;
  recorded.started_utime -= 3'600'000'000;
  recorded.utime -= 3'600'000'000;
  listener_.Publish("CERTIFIER_STATUS", recorded);  // by somebody who plays a log
  Pass(100'000);
  EXPECT_EQ(nodes_[0]->charge().state(), kInCharge);
  EXPECT_EQ(Answers().size(), 1u);
}

// ---- Arming, faults, learning, reload.

struct ArmedNodeTest : CertifierNodeTest {
  ArmedNodeTest() {
    config_.gate.needs_robot_state = true;
    Restart();
  }

  void Pass(std::int64_t us) { now_us_ += us; }

  // The robot stands at the origin of the small task, or executes a plan.
  robot_state_t State(std::int64_t plan_id = -1, int step = -1) {
    robot_state_t state = StateOf(now_us_, sequence_++, plan_id, step);
    state.state[2] = 1, state.state[3] = 0.1;
    return state;
  }
  void SayState(const robot_state_t& state) {
    bus_->Publish("ROBOT_STATE", state);
    Run();
  }
  void Reset(std::int64_t utime) {
    bus_->Publish("COMMAND", ResetAt(utime));
    Run();
  }
  void Reset() {
    Pass(1);
    Reset(now_us_);
  }
  // A state beyond the upper bound of a slice of the plan by `outside`, which is judged by what it says itself.
  robot_state_t AtUpperBound(const certified_plan_t& plan, int step) {
    ++sequence_;  // a lost message between
    robot_state_t state = State(plan.plan.plan_id, step);
    std::copy_n(plan.slice_upper[std::clamp(step, 0, 10)], 4, state.state);
    return state;
  }

  std::int64_t sequence_ = 0;
};

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

// ---- The robot's clock. E is 60 ms, D is 10 ms.

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

// ---- A certifier that was stopped.

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

struct ReloadTest : testing::Test {
  void Write(const std::string& text) const { std::ofstream(path_) << text; }
  void Copy(const std::function<std::string(std::string)>& edit, const std::string& shipped = "point_mass") const {
    const std::string text = Read(FOREREACH_SOURCE_DIR "/config/" + shipped + ".yaml");
    Write(edit(std::regex_replace(text, std::regex("data/"), FOREREACH_SOURCE_DIR "/config/data/")));
  }
  // Reads the file again and waits for what comes of it.
  void Reload(CertifierNode& node) {
    const std::int64_t version = status_.version, failed = status_.failed_reloads;
    node.Reload();
    TickUntil(node, [&] { return status_.version != version || status_.failed_reloads != failed; });
  }
  template <class Done>
  void TickUntil(CertifierNode& node, Done done) {
    for (int i = 0; i < 5000 && !done(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      node.Tick(kNow);
      bus_->Dispatch(0);
    }
  }
  // Of the shipped task, and heard.
  std::unique_ptr<CertifierNode> Begin() {
    Copy([](const std::string& text) { return text; });
    return BeginWith(LoadConfig(path_));
  }
  std::unique_ptr<CertifierNode> BeginWith(const Config& config) {
    auto node = std::make_unique<CertifierNode>(config, *bus_, Clocks{clock_, clock_});
    Hear(*bus_, "CERTIFIER_STATUS", status_);
    node->Tick(kNow);
    bus_->Dispatch(0);
    return node;
  }
  void ExpectRefused(CertifierNode& node, const std::string& why) {
    const std::int64_t failed = status_.failed_reloads, version = status_.version;
    Reload(node);
    EXPECT_EQ(status_.failed_reloads, failed + 1) << why;
    EXPECT_EQ(status_.version, version) << why;
    EXPECT_THAT(GetText(status_.message), HasSubstr(why));
  }

  const ScratchDirectory scratch_;
  const std::string path_ = scratch_ / "task.yaml";
  const Clock clock_ = [] { return kNow; };
  std::unique_ptr<Bus> bus_ = OpenBus("memq://", clock_);
  certifier_status_t status_{};
};

TEST_F(ReloadTest, TakesANewTaskWholeOrNotAtAll) {
  const auto node = Begin();
  const Config before = LoadConfig(path_);
  ASSERT_EQ(status_.version, 1);

  Copy([](const std::string& text) { return text + "\nnonsense: 3\n"; });
  ExpectRefused(*node, "nonsense");
  EXPECT_EQ(GetDigest(status_.config_digest), before.grounds.config);

  for (const auto& [change, what] :
       {std::pair{"bus: {channels: {decision: ELSEWHERE}}", "bus.channels"},
        std::pair{"realtime: {lock_memory: no}", "realtime"}, std::pair{"realtime: {fifo_priority: 3}", "realtime"}}) {
    Copy([changed = std::string(change)](const std::string& text) { return text + "\n" + changed + "\n"; });
    ExpectRefused(*node, what + std::string(" cannot change while"));
  }

  for (const auto& [gate, what] :
       {std::pair{"gate: {obstacles: bus, obstacles_lost_ms: never}", "gate.obstacles cannot change while"},
        std::pair{"gate: {obstacles: task, max_clock_error_ms: 5}", "gate.max_clock_error_ms cannot change while"},
        std::pair{"gate: {obstacles: bus}", "gate.obstacles_lost_ms: missing"},
        std::pair{"gate: {obstacles: task}\nbus: {delay_ms: 11}", "bus.delay_ms cannot change while"},
        std::pair{"gate: {}", "gate.obstacles: missing"}}) {
    Copy([changed = std::string(gate)](const std::string& text) {
      const bool has_clock = changed.find("clock") != std::string::npos;
      const std::string steps = std::regex_replace(text, std::regex("step_error_ms: any"),
                                                   has_clock ? "step_error_ms: 5" : "step_error_ms: any");
      return std::regex_replace(steps, std::regex("gate: \\{obstacles: task\\}"), changed);
    });
    ExpectRefused(*node, what);
  }

  Copy([](const std::string& text) {
    return std::regex_replace(text, std::regex("gate: \\{"), "gate: {state: elsewhere, ");
  });
  ExpectRefused(*node, "gate.state cannot change while");

  // The guard takes how far steps may be off their times from each plan.
  Copy([](const std::string& text) {
    return "# another\n" + std::regex_replace(text, std::regex("step_error_ms: any"), "step_error_ms: 5");
  });
  Reload(*node);
  EXPECT_EQ(status_.version, 2);
  EXPECT_EQ(GetDigest(status_.config_digest), LoadConfig(path_).grounds.config);
  EXPECT_EQ(GetText(status_.message), "waits for the robot's state");
}

TEST_F(ReloadTest, ANewExpressionOfTheDisturbanceIsANewDeclaration) {
  const auto node = Begin();
  std::set<Digest> declarations;
  for (const char* const bound : {"0.001*abs(vx*(ax - vy))", "0.002*abs(vx*(ax - vy))"}) {
    Copy([&](const std::string& text) {
      return std::regex_replace(text, std::regex("  state_error"),
                                "  disturbance: {vx: \"" + std::string(bound) + "\"}\n  state_error");
    });
    Reload(*node);
    EXPECT_EQ(GetDigest(status_.config_digest), LoadConfig(path_).grounds.config);
    declarations.insert(LoadConfig(path_).grounds.declaration);
  }
  EXPECT_EQ(status_.version, 3);
  EXPECT_EQ(declarations.size(), 2u);
}

TEST_F(ReloadTest, TheSizesOfTheModelCannotChange) {
  const auto node = Begin();
  Copy([](const std::string& text) { return text; }, "bicycle");
  ExpectRefused(*node, "the number of states cannot change while");
  Copy([](const std::string& text) {
    const std::string without_obstacles = std::regex_replace(text, std::regex("obstacles:\n.*\n"), "obstacles: []\n");
    return std::regex_replace(without_obstacles, std::regex("projection: \\[px, py\\]"), "projection: [px]");
  });
  ExpectRefused(*node, "the number of safety coordinates cannot change while");
  EXPECT_EQ(status_.version, 1);
}

TEST_F(ReloadTest, RefusesATaskWithAnotherKey) {
  const std::string keys = MakeTestKeys(scratch_ / "keys"), others = MakeTestKeys(scratch_ / "others");
  const auto with_key = [&](const std::string& key) {
    Copy([&](const std::string& text) { return text + (key.empty() ? "" : "\nbus: {key: " + key + "}\n"); });
  };
  with_key(keys);
  const auto node = BeginWith(LoadConfig(path_));
  with_key("");
  ExpectRefused(*node, "bus.key is missing, it was");
  with_key(others);
  ExpectRefused(*node, "bus.key is ");
  with_key(keys);
  Reload(*node);
  EXPECT_EQ(status_.version, 2) << "the same key is taken";
  std::filesystem::rename(keys, scratch_ / "old");
  ExpectRefused(*node, "cannot be read");
  std::filesystem::rename(others, keys);
  ExpectRefused(*node, "holds other keys than at the start");
}

TEST_F(ReloadTest, AKeyThatTheCommandLineGaveStays) {
  Copy([](const std::string& text) { return text; });
  Config config = LoadConfig(path_);
  config.bus.key = MakeTestKeys(scratch_ / "keys");
  config.bus.key_is_given = true;
  const auto node = BeginWith(config);
  Reload(*node);
  EXPECT_EQ(status_.version, 2) << GetText(status_.message);
}

TEST_F(ReloadTest, ArmingAndQueueAreTheNewFilesToo) {
  const auto node = Begin();
  EXPECT_EQ(node->watch().state(), Watch::State::kDisarmed);
  Copy([](const std::string& text) {
    return std::regex_replace(text, std::regex("gate: \\{"), "gate: {arming: none, queue: 1, ");
  });
  Reload(*node);
  EXPECT_EQ(node->watch().state(), Watch::State::kArmed);
  std::map<int, int> causes;
  bus_->Subscribe("PLAN_DECISION", [&](const Received& r) { ++causes[Decoded<decision_t>(r.bytes).value().cause]; });
  for (int id = 1; id <= CertifierNode::kAtOnce + 3; ++id) bus_->Publish("PLAN_CANDIDATE", Candidate(id));
  bus_->Dispatch(0);
  node->Tick(kNow);
  bus_->Dispatch(0);
  EXPECT_EQ(causes[decision_t::CAUSE_QUEUE_FULL], 2);
  Copy([](const std::string& text) { return text; });
  Reload(*node);
  EXPECT_EQ(node->watch().state(), Watch::State::kDisarmed);
}

TEST_F(ReloadTest, NoDeclarationComesBackThatATransitionContradicts) {
  const auto node = Begin();
  bus_->Publish("TRANSITION", Executed(*node->gate().certifier().problem().model, Vec({0, 0, 2, 0.1, 0, 0}), 1));
  bus_->Dispatch(0);
  ASSERT_TRUE(node->gate().certifier().violation());
  const auto reload_with = [&](const std::string& noise) {
    Copy([&](const std::string& text) {
      return std::regex_replace(text, std::regex("noise_bound: \\[.*\\]"), "noise_bound: [2, 2, " + noise + ", 2]");
    });
    Reload(*node);
  };
  for (const std::string noise : {"0", "0.1"}) {
    reload_with(noise);
    EXPECT_TRUE(node->gate().certifier().violation()) << noise;
  }
  EXPECT_EQ(status_.failed_reloads, 2);
  reload_with("2");
  EXPECT_EQ(status_.version, 2);
  EXPECT_FALSE(node->gate().certifier().violation());
  reload_with("0.1");
  EXPECT_EQ(status_.failed_reloads, 3) << "nor after another";
}

TEST_F(ReloadTest, ReloadsOnceMoreForRequestsDuringAReload) {
  const auto node = Begin();
  for (int i = 0; i < 3; ++i) node->Reload();
  TickUntil(*node, [&] { return status_.version >= 3; });
  EXPECT_EQ(status_.version, 3) << "the first, and one for those asked for while it was under way";
}

}  // namespace forereach::certifier_node_test
