// An abstention S is tried again in pieces of X_0 while there is time, and never longer.
#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "certifier/gate/plan_ledger.h"
#include "lcmtypes/seal.h"
#include "tests/certifier/gap_task.h"
#include "tests/messages.h"
#include "tests/oracle/traced_random.h"

namespace forereach::gate_pieces_test {

constexpr std::int64_t kNow = 1'700'000'000'000'000;

struct GatePiecesTest : testing::Test {
  GateAnswer Decide(const Gate::TimeSource& clock) {
    return gate_.Decide(Encode(GapCandidate(config_, next_plan_id_++, kNow)), clock);
  }
  GateAnswer Decide() {
    return Decide([] { return kNow; });
  }

  ScratchDirectory scratch_;
  Config config_ = GapTask(scratch_);
  Gate gate_{config_};
  std::int64_t next_plan_id_ = 1;
};

TEST_F(GatePiecesTest, ACertificateSaysInHowMany) {
  const GateAnswer answer = Decide();
  ASSERT_TRUE(answer.certified) << GetText(answer.decision.message);
  EXPECT_FIELDS(answer.decision, (cause, decision_t::CAUSE_NONE), (step, -1), (obstacle, 0));
  EXPECT_GT(answer.decision.margin, answer.decision.threshold);
  EXPECT_THAT(GetText(answer.decision.message), ContainsRegex("^certified at .*; X0 in [0-9]+ pieces$"));
  EXPECT_THAT(FindSealFaults(*answer.certified), IsEmpty());
  for (int k = 0; k < 6; ++k) {
    EXPECT_LE(answer.certified->slice_lower[0][k], config_.initial_set.lower()[k]);
    EXPECT_GE(answer.certified->slice_upper[0][k], config_.initial_set.upper()[k]);
  }
}

TEST_F(GatePiecesTest, WithoutTheKeyX0IsWhole) {
  const GateAnswer answer = Gate(GapTask(scratch_, "", "whole")).Decide(Encode(GapCandidate(config_, 1, kNow)), kNow);
  EXPECT_FALSE(answer.certified);
  EXPECT_EQ(answer.decision.cause, decision_t::CAUSE_OBSTACLE);
  EXPECT_THAT(GetText(answer.decision.message), Not(HasSubstr("pieces")));
}

// 5 ms of budget, half of it for trials. Of a clock that goes on by `cost` with every reading, each call takes that.
TEST_F(GatePiecesTest, NoTrialBeginsThatWouldEndTooLate) {
  for (const auto& [cost, trials] :
       {std::pair(100, -1), {250, 9}, {500, 4}, {625, 3}, {626, 2}, {1250, 1}, {1251, 0}, {2000, 0}, {4999, 0}}) {
    std::int64_t now = kNow - cost;
    const GateAnswer answer = Decide([&now, cost = cost] { return now += cost; });
    SCOPED_TRACE(GetText(answer.decision.message));
    EXPECT_EQ(answer.certified.has_value(), trials < 0) << cost;
    if (trials < 0) continue;
    EXPECT_EQ(answer.decision.cause, decision_t::CAUSE_OBSTACLE);
    EXPECT_THAT(GetText(answer.decision.message),
                EndsWith("; so after " + std::to_string(trials) + " trials with X0 in pieces"));
  }
}

TEST_F(GatePiecesTest, TheLongestCallSoFarCounts) {
  const std::vector<std::int64_t> costs{0, 10, 10, 1000, 10, 10, 600, 10};  // the sixth ends at 1,630; + 1,000 > 2,500
  std::size_t reading = 0;
  std::int64_t now = kNow;
  const GateAnswer answer = Decide([&] { return now += costs.at(std::min(reading++, costs.size() - 1)); });
  EXPECT_THAT(GetText(answer.decision.message), EndsWith("; so after 5 trials with X0 in pieces"));
}

// Under load a call takes any time, and longer than the longest before. The clock is read before, between and after the
// calls.
TEST_F(GatePiecesTest, UnderLoadNothingIsCertifiedLaterThanTheBudget) {
  int in_time = 0, late = 0, given_up = 0;
  for (TracedRandom random(37); random.Again(600);) {
    std::vector<std::int64_t> read;
    std::int64_t now = kNow;
    const GateAnswer answer = Decide([&] {
      now += random.Coin(0.05) ? random.Integer(0, 20'000) : random.Integer(0, 100);
      read.push_back(now - kNow);
      return now;
    });
    const std::int64_t begin = read.front(), taken = read.back() - begin;
    ASSERT_GE(read.size(), 3u);
    std::int64_t longest = 0;
    for (std::size_t i = 1; i + 2 < read.size(); ++i) {
      longest = std::max(longest, read[i] - read[i - 1]);
      ASSERT_LE(read[i] + longest, begin + 2500) << "trial " << i << " is not to begin";
    }
    const bool is_late = answer.decision.cause == decision_t::CAUSE_OVERRUN;
    EXPECT_EQ(is_late || answer.certified.has_value(), answer.decision.cause != decision_t::CAUSE_OBSTACLE);
    if (answer.certified) EXPECT_LE(taken, 5000);
    if (is_late) EXPECT_GT(taken, 5000);
    ++(is_late ? late : answer.certified ? in_time : given_up);
  }
  EXPECT_GT(in_time, 10);
  EXPECT_GT(late, 2);
  EXPECT_GT(given_up, 10);
}

TEST_F(GatePiecesTest, WhatWasCertifiedInPiecesStandsWhenItIsJudgedAgain) {
  const GateAnswer answer = Decide();
  ASSERT_TRUE(answer.certified);
  const Upheld upheld = UpheldBy(*answer.certified);
  for (const int first : {0, 5, 12}) {
    const Standing standing = gate_.JudgeAgain(answer.certified->plan, upheld, first);
    EXPECT_EQ(standing.verdict.outcome, Outcome::kCertified) << first;
    EXPECT_EQ(standing.steps, 12) << first;
  }
  Gate whole(GapTask(scratch_, "", "whole")),
      hurried(GapTask(scratch_, ", max_pieces: 16, decision_budget_ms: 0.001", "hurried"));
  EXPECT_EQ(hurried.JudgeAgain(answer.certified->plan, upheld, 0).verdict.outcome, Outcome::kSafety);
  EXPECT_EQ(whole.JudgeAgain(answer.certified->plan, upheld, 0).verdict.outcome, Outcome::kSafety);
}

}  // namespace forereach::gate_pieces_test
