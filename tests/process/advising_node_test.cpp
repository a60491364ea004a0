// What comes after a decision: an advice, where the task asks for it, or a repair, where the candidate does.
#include "tests/test.h"

#include "tests/process/certifier_node_fixture.h"

namespace forereach::advising_node_test {

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

}  // namespace forereach::advising_node_test
