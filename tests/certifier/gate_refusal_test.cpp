// Every refusal of the gate, at its boundary, with its own cause.
#include <initializer_list>

#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "lcmtypes/freshness.h"
#include "lcmtypes/seal.h"
#include "tests/certifier/small_task.h"

namespace forereach::gate_refusal_test {

using Shorts = std::initializer_list<std::int16_t>;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min(), kMax = std::numeric_limits<std::int64_t>::max();

struct GateRefusalTest : testing::Test {
  decision_t Decide(const candidate_plan_t& candidate) { return Decide(Encode(candidate)); }
  decision_t Decide(const std::vector<std::uint8_t>& bytes) {
    const GateAnswer answer = gate_.Decide(bytes, kNow);
    EXPECT_EQ(answer.certified.has_value(), answer.decision.outcome == decision_t::CERTIFIED);
    return answer.decision;
  }

  // A candidate is refused for `cause`; the good one with the same plan_id, sent after it, is certified.
  void ExpectRefused(const std::vector<std::uint8_t>& bytes, int cause) {
    const decision_t decision = Decide(bytes);
    EXPECT_EQ(decision.outcome, decision_t::REJECTED);
    EXPECT_EQ(decision.cause, cause) << GetText(decision.message);
    EXPECT_THAT(GetText(decision.message), HasSubstr("rejected: "));
    EXPECT_EQ(decision.step, -1);
    EXPECT_EQ(GetDigest(decision.plan_digest), PlanDigest(Bytes(bytes)));
    EXPECT_EQ(Decide(Candidate(next_plan_id_++)).outcome, decision_t::CERTIFIED) << "good again";
  }
  void ExpectRefused(const candidate_plan_t& candidate, int cause) { ExpectRefused(Encode(candidate), cause); }

  void ExpectRefused(int cause, const std::function<void(candidate_plan_t&)>& corrupt) {
    candidate_plan_t candidate = Candidate(next_plan_id_);
    corrupt(candidate);
    ExpectRefused(candidate, cause);
  }
  void ExpectAdmitted(const std::function<void(candidate_plan_t&)>& change) {
    candidate_plan_t candidate = Candidate(next_plan_id_++);
    change(candidate);
    const decision_t decision = Decide(candidate);
    EXPECT_NE(decision.outcome, decision_t::REJECTED) << GetText(decision.message);
  }

  Gate gate_{SmallTask()};  // max_age_ms 500, max_ahead_ms 50, certificate_lifetime_ms 2000
  std::int64_t next_plan_id_ = 1;
};

TEST_F(GateRefusalTest, RejectsACandidateThatIsOlderThanMaxAge) {
  ExpectAdmitted([](auto& c) { c.utime = kNow - 500'000; });
  ExpectRefused(decision_t::CAUSE_STALE, [](auto& c) { c.utime = kNow - 500'001; });
  ExpectRefused(decision_t::CAUSE_STALE, [](auto& c) { c.utime = 0; });
  ExpectRefused(decision_t::CAUSE_STALE, [](auto& c) { c.utime = kMin; });
}

TEST_F(GateRefusalTest, RejectsACandidateThatIsFurtherAheadThanMaxAhead) {
  ExpectAdmitted([](auto& c) { c.utime = kNow + 50'000; });
  ExpectRefused(decision_t::CAUSE_FUTURE, [](auto& c) { c.utime = kNow + 50'001; });
  ExpectRefused(decision_t::CAUSE_FUTURE, [](auto& c) { c.utime = kMax; });
}

TEST_F(GateRefusalTest, RejectsACandidateThatArrivesAfterItsStart) {
  ExpectAdmitted([](auto& c) { c.start_utime = kNow; });
  ExpectRefused(decision_t::CAUSE_TOO_LATE, [](auto& c) { c.start_utime = kNow - 1; });
  ExpectRefused(decision_t::CAUSE_TOO_LATE, [](auto& c) { c.start_utime = 0; });
  ExpectRefused(decision_t::CAUSE_TOO_LATE, [](auto& c) { c.start_utime = kMin; });
}

TEST_F(GateRefusalTest, RejectsACandidateThatStartsAfterItsCertificateWouldExpire) {
  ExpectAdmitted([](auto& c) { c.start_utime = kNow + 2'000'000; });
  ExpectRefused(decision_t::CAUSE_FUTURE, [](auto& c) { c.start_utime = kNow + 2'000'001; });
  ExpectRefused(decision_t::CAUSE_FUTURE, [](auto& c) { c.start_utime = kMax; });
}

TEST_F(GateRefusalTest, AbstainsFromACandidateThatStartsBeforeADecisionCanBeExpected) {
  Config config = SmallTask();
  config.gate.decision_budget_ms = 400;
  Gate gate(config);
  EXPECT_EQ(gate.EarliestStart(kNow), kNow + 400'000);
  EXPECT_EQ(gate.EarliestStart(kMax - 1), kMax);
  candidate_plan_t candidate = Candidate(1);
  candidate.start_utime = kNow + 399'999;
  const decision_t decision = gate.Decide(Encode(candidate), kNow).decision;
  EXPECT_FIELDS(decision, (outcome, decision_t::ABSTAIN_DEADLINE), (cause, decision_t::CAUSE_DEADLINE));
  EXPECT_THAT(GetText(decision.message), HasSubstr("it starts in 399.999 ms, a decision may take 400 ms"));
  candidate = Candidate(2);
  candidate.start_utime = kNow + 400'000;
  EXPECT_EQ(gate.Decide(Encode(candidate), kNow).decision.outcome, decision_t::CERTIFIED);
}

TEST_F(GateRefusalTest, LimitsInMillisecondsAreRoundedToTheNearestMicrosecond) {
  Config config = SmallTask();
  config.gate.max_age_ms = 1.001;  // times 1000, the double is just below 1001
  Gate gate(config);
  candidate_plan_t candidate = Candidate(1);
  candidate.utime = kNow - 1001;
  EXPECT_EQ(gate.Decide(Encode(candidate), kNow).decision.outcome, decision_t::CERTIFIED);
}

TEST_F(GateRefusalTest, RejectsAPlanIdThatIsUsedOrTooOld) {
  for (const std::int64_t plan_id : {5, 6, 100}) EXPECT_EQ(Decide(Candidate(plan_id)).outcome, decision_t::CERTIFIED);
  next_plan_id_ = 101;
  ExpectRefused(Candidate(100), decision_t::CAUSE_DUPLICATE);
  ExpectRefused(Candidate(100), decision_t::CAUSE_DUPLICATE);
  ExpectRefused(Candidate(5), decision_t::CAUSE_DUPLICATE);
  ExpectRefused(Candidate(kMin), decision_t::CAUSE_DUPLICATE);
}

TEST_F(GateRefusalTest, AnAbstentionUsesItsPlanIdUpARefusalDoesNot) {
  EXPECT_EQ(Decide(Candidate(1, kAccelerationIntoTheCircle)).outcome, decision_t::ABSTAIN_SAFETY);
  EXPECT_EQ(Decide(Candidate(1)).cause, decision_t::CAUSE_DUPLICATE);
  candidate_plan_t stale = Candidate(2);
  stale.utime = 0;
  EXPECT_EQ(Decide(stale).cause, decision_t::CAUSE_STALE);
  EXPECT_EQ(Decide(Candidate(2)).outcome, decision_t::CERTIFIED);
}

TEST_F(GateRefusalTest, SourcesCountTheirPlansIndependently) {
  EXPECT_EQ(Decide(Candidate(10)).outcome, decision_t::CERTIFIED);
  candidate_plan_t other = Candidate(3);
  SetText(other.source, "test2");
  EXPECT_EQ(Decide(other).outcome, decision_t::CERTIFIED);
  EXPECT_EQ(Decide(other).cause, decision_t::CAUSE_DUPLICATE);
  EXPECT_EQ(Decide(Candidate(11)).outcome, decision_t::CERTIFIED);
}

TEST_F(GateRefusalTest, TheWholeLabelTellsSourcesApart) {
  EXPECT_EQ(Decide(Candidate(10)).outcome, decision_t::CERTIFIED);
  candidate_plan_t other = Candidate(10);
  other.source[31] = 1;
  EXPECT_EQ(Decide(other).outcome, decision_t::CERTIFIED);
}

TEST_F(GateRefusalTest, RejectsOneSourceMoreThanItKeepsApart) {
  static_assert(Sources::kMaxSources == 16);
  for (int source = 0; source < 16; ++source) {
    candidate_plan_t candidate = Candidate(1);
    SetText(candidate.source, "source " + std::to_string(source));
    EXPECT_EQ(Decide(candidate).outcome, decision_t::CERTIFIED) << source;
  }
  candidate_plan_t candidate = Candidate(1);
  SetText(candidate.source, "source 16");
  EXPECT_EQ(Decide(candidate).cause, decision_t::CAUSE_TOO_MANY_SOURCES);
  candidate = Candidate(2);
  SetText(candidate.source, "source 15");
  EXPECT_EQ(Decide(candidate).outcome, decision_t::CERTIFIED) << "known sources go on";
}

TEST_F(GateRefusalTest, ARefusedCandidateTakesNoSourceSlot) {
  for (int source = 0; source < 40; ++source) {
    candidate_plan_t candidate = Candidate(1);
    SetText(candidate.source, "source " + std::to_string(source));
    candidate.utime = 0;
    EXPECT_EQ(Decide(candidate).cause, decision_t::CAUSE_STALE);
  }
  EXPECT_EQ(Decide(Candidate(1)).outcome, decision_t::CERTIFIED);
}

TEST_F(GateRefusalTest, RejectsACandidateOfAWrongDimension) {
  for (const std::int16_t n : Shorts{-32768, -1, 0, 3, 5, 16, 17, 32767})
    ExpectRefused(decision_t::CAUSE_WRONG_DIMENSION, [n](auto& c) { c.num_states = n; });
  for (const std::int16_t m : Shorts{-32768, -1, 0, 1, 3, 8, 9, 32767})
    ExpectRefused(decision_t::CAUSE_WRONG_DIMENSION, [m](auto& c) { c.num_inputs = m; });
  for (const std::int16_t steps : Shorts{-32768, -1, 0, 129, 32767})
    ExpectRefused(decision_t::CAUSE_WRONG_DIMENSION, [steps](auto& c) { c.num_steps = steps, c.progress_steps = 0; });
  for (const std::int16_t progress : Shorts{-32768, -1, 11, 32767})
    ExpectRefused(decision_t::CAUSE_WRONG_DIMENSION, [progress](auto& c) { c.progress_steps = progress; });
}

TEST_F(GateRefusalTest, RejectsAStepOfAnotherTimeThanTheModels) {
  Config config = SmallTask();
  config.gate.step_us = 150'000;
  Gate gate(config);
  const auto cause_of = [&](std::int64_t step_us) {
    candidate_plan_t candidate = Candidate(next_plan_id_++);
    candidate.step_us = step_us;
    return gate.Decide(Encode(candidate), kNow).decision.cause;
  };
  EXPECT_EQ(cause_of(150'000), decision_t::CAUSE_NONE);
  for (const std::int64_t step_us : {kMin, std::int64_t{0}, std::int64_t{149'999}, std::int64_t{150'001}, kMax})
    EXPECT_EQ(cause_of(step_us), decision_t::CAUSE_WRONG_DIMENSION) << step_us;
}

TEST_F(GateRefusalTest, SmallestAndLargestDimensionsAreAdmitted) {
  ExpectAdmitted([](auto& c) { c.num_steps = 1, c.progress_steps = 0; });
  ExpectAdmitted([](auto& c) { c.num_steps = 1, c.progress_steps = 1; });
  ExpectAdmitted([](auto& c) { c.num_steps = 128, c.progress_steps = 128; });
}

TEST_F(GateRefusalTest, RejectsNumbersThatAreNotFiniteInEntriesInUse) {
  for (const double bad : {kNaN, -kNaN, kInf, -kInf}) {
    for (int k = 0; k < 4; ++k) {
      ExpectRefused(decision_t::CAUSE_NON_FINITE, [=](auto& c) { c.initial_center[k] = bad; });
      ExpectRefused(decision_t::CAUSE_NON_FINITE, [=](auto& c) { c.initial_half_width[k] = bad; });
    }
    for (int t = 0; t < 10; ++t)
      for (int i = 0; i < 2; ++i) ExpectRefused(decision_t::CAUSE_NON_FINITE, [=](auto& c) { c.control[t][i] = bad; });
  }
}

TEST_F(GateRefusalTest, AdmitsAnyNumbersInEntriesNotInUse) {
  candidate_plan_t candidate = Candidate(1);
  candidate.initial_center[4] = candidate.initial_half_width[15] = kNaN;
  candidate.control[0][2] = candidate.control[10][0] = candidate.control[127][7] = kInf;
  EXPECT_EQ(Decide(candidate).outcome, decision_t::CERTIFIED);
}

TEST_F(GateRefusalTest, RejectsANegativeHalfWidth) {
  for (int k = 0; k < 4; ++k) {
    ExpectRefused(decision_t::CAUSE_NON_FINITE,
                  [k](auto& c) { c.initial_half_width[k] = -std::numeric_limits<double>::denorm_min(); });
    ExpectAdmitted([k](auto& c) { c.initial_half_width[k] = 0; });
    ExpectAdmitted([k](auto& c) { c.initial_half_width[k] = -0.0; });
  }
}

TEST_F(GateRefusalTest, RejectsEveryTruncation) {
  const std::vector<std::uint8_t> good = Encode(Candidate(1));
  for (std::size_t size = 0; size < good.size(); ++size) {
    const decision_t decision = Decide(std::vector(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)));
    ASSERT_EQ(decision.outcome, decision_t::REJECTED);
    ASSERT_EQ(decision.cause, decision_t::CAUSE_WRONG_LENGTH) << size;
  }
  EXPECT_EQ(Decide(good).outcome, decision_t::CERTIFIED);
}

TEST_F(GateRefusalTest, RejectsTrailingBytes) {
  for (const std::size_t more : {1, 2, 8, 100'000}) {
    std::vector<std::uint8_t> bytes = Encode(Candidate(next_plan_id_));
    bytes.resize(bytes.size() + more);
    ExpectRefused(bytes, decision_t::CAUSE_TRAILING_BYTES);
  }
}

TEST_F(GateRefusalTest, RejectsAnUnknownFingerprint) {
  ExpectRefused(Encode(transition_t{}), decision_t::CAUSE_UNKNOWN_FINGERPRINT);
  ExpectRefused(Encode(decision_t{}), decision_t::CAUSE_UNKNOWN_FINGERPRINT);
  for (std::size_t i = 0; i < 8; ++i) {
    std::vector<std::uint8_t> bytes = Encode(Candidate(next_plan_id_));
    bytes[i] ^= 1;
    ExpectRefused(bytes, decision_t::CAUSE_UNKNOWN_FINGERPRINT);
  }
}

TEST_F(GateRefusalTest, EmptyBytesLeaveNothingOfACandidateInTheDecision) {
  const decision_t decision = Decide(std::vector<std::uint8_t>{});
  EXPECT_FIELDS(decision, (cause, decision_t::CAUSE_WRONG_LENGTH), (plan_id, 0), (candidate_utime, 0));
  EXPECT_EQ(GetText(decision.source), "");
  EXPECT_EQ(decision.utime, kNow);
}

TEST_F(GateRefusalTest, WhatCouldBeDecodedIsNamedInTheDecision) {
  candidate_plan_t candidate = Candidate(42);
  candidate.utime = 17;
  const decision_t decision = Decide(candidate);
  EXPECT_FIELDS(decision, (cause, decision_t::CAUSE_STALE), (plan_id, 42), (candidate_utime, 17));
  EXPECT_EQ(GetText(decision.source), "test");
}

TEST_F(GateRefusalTest, ADisplacedCandidateIsRejectedHoweverGood) {
  for (const auto& bytes : {Encode(Candidate(1)), std::vector<std::uint8_t>{}}) {
    const GateAnswer answer =
        gate_.Refuse(bytes, kNow, decision_t::CAUSE_QUEUE_FULL, "newer candidates displaced it from the queue");
    EXPECT_EQ(answer.decision.outcome, decision_t::REJECTED);
    EXPECT_EQ(answer.decision.cause, bytes.empty() ? decision_t::CAUSE_WRONG_LENGTH : decision_t::CAUSE_QUEUE_FULL);
    EXPECT_FALSE(answer.certified);
  }
  EXPECT_EQ(gate_.Status(kNow).by_outcome[decision_t::REJECTED], 2);
  EXPECT_EQ(Decide(Candidate(2)).outcome, decision_t::CERTIFIED);
}

TEST_F(GateRefusalTest, RejectsACandidateWhenCertifyingThrows) {
  Config config = SmallTask();
  config.obstacles = {Obstacle::HalfSpace(Eigen::VectorXd::Ones(1), 100)};  // not in the safety dimension
  Gate gate(config);
  const GateAnswer answer = gate.Decide(Encode(Candidate(1)), kNow);
  EXPECT_FIELDS(answer.decision, (outcome, decision_t::REJECTED), (cause, decision_t::CAUSE_INTERNAL_ERROR));
  EXPECT_THAT(GetText(answer.decision.message), HasSubstr("internal error: obstacle 0: dimension 1"));
  EXPECT_FALSE(answer.certified);
}

TEST_F(GateRefusalTest, NumbersTooLargeToWorkWithAreNeitherCertifiedNorFatal) {
  for (const double huge : {1e100, 1e308, std::numeric_limits<double>::max()}) {
    for (int k = 0; k < 4; ++k) {
      candidate_plan_t candidate = Candidate(next_plan_id_++);
      candidate.initial_center[k] = huge;
      candidate.initial_half_width[k] = huge;
      EXPECT_EQ(Decide(candidate).outcome, decision_t::ABSTAIN_DOMAIN) << huge << " " << k;
    }
    candidate_plan_t candidate = Candidate(next_plan_id_++);
    candidate.control[3][1] = -huge;
    EXPECT_EQ(Decide(candidate).outcome, decision_t::ABSTAIN_DOMAIN) << huge;
  }
}

TEST(FreshnessTest, IsFreshUpToItsBoundsAndForExtremeStamps) {
  using enum Freshness;
  EXPECT_EQ(FreshnessOf(0, 0, 0, 0), kFresh);
  EXPECT_EQ(FreshnessOf(-1, 0, 0, 0), kStale);
  EXPECT_EQ(FreshnessOf(1, 0, 0, 0), kFuture);
  EXPECT_EQ(FreshnessOf(-7, 0, 7, 0), kFresh);
  EXPECT_EQ(FreshnessOf(-8, 0, 7, 0), kStale);
  EXPECT_EQ(FreshnessOf(7, 0, 0, 7), kFresh);
  EXPECT_EQ(FreshnessOf(8, 0, 0, 7), kFuture);
  EXPECT_EQ(FreshnessOf(kMin, kMax, kMax, kMax), kStale);
  EXPECT_EQ(FreshnessOf(kMax, kMin, kMax, kMax), kFuture);
  EXPECT_EQ(FreshnessOf(kMin, -1, kMax, 0), kFresh);
  EXPECT_EQ(FreshnessOf(kMin, 0, kMax, 0), kStale);
  EXPECT_EQ(FreshnessOf(kMax, 0, 0, kMax), kFresh);
  EXPECT_EQ(FreshnessOf(kMax, -1, 0, kMax), kFuture);
  EXPECT_EQ(FreshnessOf(kMin, kMin, 0, 0), kFresh);
  EXPECT_EQ(FreshnessOf(kMax, kMax, 0, 0), kFresh);
}

}  // namespace forereach::gate_refusal_test
