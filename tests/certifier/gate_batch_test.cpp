// A batch is answered by one decision, on a candidate that could have been sent alone.
#include "tests/test.h"

#include "certifier/gate/candidate_message.h"
#include "certifier/gate/gate.h"
#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/seal.h"
#include "tests/certifier/small_task.h"

namespace forereach::gate_batch_test {

constexpr double kGood = kAccelerationThatCertifies, kCollides = kAccelerationIntoTheCircle,
                 kLeaves = kAccelerationOutsideDomain;

candidate_batch_t BatchOf(const std::vector<double>& accelerations, std::int64_t plan_id = 1) {
  candidate_batch_t batch{};
  for (const double acceleration : accelerations)
    EXPECT_TRUE(Append(batch, Candidate(plan_id + batch.num_candidates, acceleration)));
  return batch;
}

struct GateBatchTest : testing::Test {
  GateAnswer Decide(const candidate_batch_t& batch) { return gate_.Decide(Encode(batch), kNow); }

  void ExpectRefused(int cause, const std::string& why, const std::function<void(candidate_batch_t&)>& corrupt) {
    candidate_batch_t batch = BatchOf({kCollides, kGood}, next_plan_id_);
    corrupt(batch);
    const GateAnswer answer = Decide(batch);
    EXPECT_EQ(answer.decision.outcome, decision_t::REJECTED) << why;
    EXPECT_EQ(answer.decision.cause, cause) << GetText(answer.decision.message);
    EXPECT_THAT(GetText(answer.decision.message), HasSubstr(why));
    EXPECT_FALSE(answer.certified);
    EXPECT_EQ(Decide(BatchOf({kCollides, kGood}, next_plan_id_)).decision.outcome, decision_t::CERTIFIED) << why;
    next_plan_id_ += 10;
  }

  Gate gate_{SmallTask()};
  std::int64_t next_plan_id_ = 1;
};

TEST(CandidateBatch, GivesBackWhatWasAppended) {
  candidate_batch_t batch{};
  std::vector<candidate_plan_t> candidates;
  for (int k = 0; k < 30; ++k) {
    candidate_plan_t& candidate = candidates.emplace_back(Candidate(7 + k, 0.01 * k));
    candidate.num_steps = static_cast<std::int16_t>(1 + k % 10);
    candidate.progress_steps = static_cast<std::int16_t>(k % 3 == 0);
    for (int t = candidate.num_steps; t < 10; ++t) candidate.control[t][0] = 0;
    ASSERT_TRUE(Append(batch, candidate));
  }
  EXPECT_EQ(WhyNoBatch(batch), "");
  const std::vector<std::uint8_t> bytes = Encode(batch);
  EXPECT_EQ(KeyOfCandidates(bytes), BatchKey(candidates[9].source, candidates[9].utime)) << "as a decision names it";
  for (int k = 0; k < 30; ++k) {
    const std::vector<std::uint8_t> alone = Encode(candidates[static_cast<std::size_t>(k)]);
    EXPECT_EQ(Encode(CandidateOf(batch, k)), alone) << k;
    EXPECT_EQ(CandidateIn(bytes, PlanDigest(Bytes(alone))), alone) << k;
  }
}

TEST(CandidateBatch, TakesNoMoreThanThereIsRoomFor) {
  candidate_batch_t many{}, large{};
  candidate_plan_t one = Candidate(1);
  one.num_steps = one.progress_steps = 1;
  for (int k = 0; k < kMaxBatch; ++k) ASSERT_TRUE(Append(many, one)) << k;
  EXPECT_FALSE(Append(many, one));
  EXPECT_EQ(WhyNoBatch(many), "");
  one.num_steps = 128;
  while (Append(large, one)) {
  }
  EXPECT_EQ(large.num_candidates, kMaxBatchNumbers / (128 * 2));
  EXPECT_EQ(WhyNoBatch(large), "");
}

TEST(CandidateBatch, AnyOtherMessageStandsForItself) {
  const std::vector<std::uint8_t> candidate = Encode(Candidate(1)), empty = Encode(candidate_batch_t{});
  for (const std::vector<std::uint8_t>& bytes : {candidate, empty, {}, {1, 2, 3}}) {
    EXPECT_EQ(KeyOfCandidates(bytes), PlanDigest(Bytes(bytes)));
    EXPECT_EQ(CandidateIn(bytes, PlanDigest(Bytes(bytes))), bytes);
  }
}

TEST_F(GateBatchTest, TheFirstThatIsCertifiedIsAnsweredAsIfItWasSentAlone) {
  const candidate_batch_t batch = BatchOf({kCollides, kLeaves, kGood, kCollides, kGood});
  const GateAnswer answer = Decide(batch);
  ASSERT_TRUE(answer.certified);
  EXPECT_EQ(answer.decision.plan_id, 3);
  EXPECT_TRUE(FindSealFaults(*answer.certified).empty());

  GateAnswer alone = Gate(SmallTask()).Decide(Encode(Candidate(3)), kNow);
  EXPECT_EQ(Encode(*answer.certified), Encode(*alone.certified));
  EXPECT_EQ(GetText(answer.decision.message), "candidate 2 of 0..4: " + GetText(alone.decision.message));
  std::ranges::copy(answer.decision.message, alone.decision.message);
  EXPECT_EQ(Encode(answer.decision), Encode(alone.decision));
  EXPECT_EQ(gate_.Status(kNow).candidates, 1) << "one decision";
}

TEST_F(GateBatchTest, WithoutACertificateTheFirstIsAnsweredAndTheCausesAreCounted) {
  const GateAnswer answer = Decide(BatchOf({kLeaves, kCollides, kCollides}));
  EXPECT_FALSE(answer.certified);
  EXPECT_FIELDS(answer.decision, (plan_id, 1), (outcome, decision_t::ABSTAIN_DOMAIN));
  EXPECT_THAT(GetText(answer.decision.message),
              StartsWith("none of 3 (domain_exit 1, obstacle 2); the first: abstain D"));
}

TEST_F(GateBatchTest, InShadowModeNothingIsCertified) {
  Config config = SmallTask();
  config.gate.shadow = true;
  const GateAnswer answer = Gate(config).Decide(Encode(BatchOf({kCollides, kGood})), kNow);
  EXPECT_FALSE(answer.certified);
  EXPECT_FIELDS(answer.decision, (cause, decision_t::CAUSE_SHADOW), (plan_id, 2));
}

TEST_F(GateBatchTest, WhatIsRefusedFromOutsideIsRefusedByItsFirst) {
  const GateAnswer answer =
      gate_.Refuse(Encode(BatchOf({kCollides, kGood})), kNow, decision_t::CAUSE_NOT_ARMED, "no robot");
  EXPECT_FIELDS(answer.decision, (cause, decision_t::CAUSE_NOT_ARMED), (plan_id, 1));
  EXPECT_FALSE(answer.certified);
}

TEST_F(GateBatchTest, IsRefusedForWhatAMessageMayNotBe) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr int kDimension = decision_t::CAUSE_WRONG_DIMENSION, kNumber = decision_t::CAUSE_NON_FINITE;
  ExpectRefused(kDimension, "num_candidates is 0", [](auto& b) { b.num_candidates = 0; });
  ExpectRefused(kDimension, "num_candidates is -1", [](auto& b) { b.num_candidates = -1; });
  ExpectRefused(kDimension, "num_candidates is 257", [](auto& b) { b.num_candidates = 257; });
  ExpectRefused(kDimension, "num_candidates is 32767", [](auto& b) { b.num_candidates = 32767; });
  ExpectRefused(kDimension, "num_states is 17", [](auto& b) { b.num_states = 17; });
  ExpectRefused(kDimension, "num_inputs is 0", [](auto& b) { b.num_inputs = 0; });
  ExpectRefused(kDimension, "num_inputs is 9", [](auto& b) { b.num_inputs = 9; });
  ExpectRefused(kDimension, "num_steps[1] is 0", [](auto& b) { b.num_steps[1] = 0; });
  ExpectRefused(kDimension, "num_steps[1] is 129", [](auto& b) { b.num_steps[1] = 129; });
  ExpectRefused(kDimension, "progress_steps[0] is 11", [](auto& b) { b.progress_steps[0] = 11; });
  ExpectRefused(kDimension, "progress_steps[0] is -1", [](auto& b) { b.progress_steps[0] = -1; });
  ExpectRefused(kDimension, "7682, must be at most 7680", [](auto& b) {
    b.num_candidates = 31;
    std::fill_n(b.num_steps, 30, std::int16_t{128});
    std::fill_n(b.progress_steps, 31, std::int16_t{0});
    b.num_steps[30] = 1;
  });
  ExpectRefused(kDimension, "plan_id is", [](auto& b) { b.plan_id = std::numeric_limits<std::int64_t>::max() - 255; });
  ExpectRefused(kDimension, "candidate 0 of 0..1: rejected: 3 states", [](auto& b) { b.num_states = 3; });
  ExpectRefused(kNumber, "candidate 1 of 0..1: rejected: plan: step 4: ", [](auto& b) { b.control[20 + 8] = kNaN; });
  ExpectRefused(kNumber, "candidate 0 of 0..1: rejected: initial set", [](auto& b) { b.initial_half_width[2] = -1; });
  ExpectRefused(decision_t::CAUSE_STALE, "candidate 0 of 0..1: rejected: ", [](auto& b) { b.utime -= 500'001; });
  ExpectRefused(decision_t::CAUSE_TOO_LATE,
                "candidate 0 of 0..1: rejected: ", [](auto& b) { b.start_utime = kNow - 1; });
}

TEST_F(GateBatchTest, BytesOfAnotherLengthAreRefused) {
  std::vector<std::uint8_t> bytes = Encode(BatchOf({kGood}));
  bytes.push_back(0);
  EXPECT_EQ(gate_.Decide(bytes, kNow).decision.cause, decision_t::CAUSE_TRAILING_BYTES);
  bytes.resize(bytes.size() - 2);
  EXPECT_EQ(gate_.Decide(bytes, kNow).decision.cause, decision_t::CAUSE_WRONG_LENGTH);
  EXPECT_EQ(GetDigest(gate_.Decide(bytes, kNow).decision.plan_digest), PlanDigest(Bytes(bytes)));
}

TEST_F(GateBatchTest, IsARepetitionIfAnIdOfItWasDecidedOn) {
  const candidate_batch_t batch = BatchOf({kCollides, kGood, kGood});
  ASSERT_TRUE(Decide(batch).certified);
  EXPECT_FIELDS(Decide(batch).decision, (cause, decision_t::CAUSE_DUPLICATE), (plan_id, 2));
  EXPECT_EQ(Decide(BatchOf({kGood, kGood}, 1)).decision.cause, decision_t::CAUSE_DUPLICATE);
  EXPECT_EQ(gate_.Decide(Encode(Candidate(2)), kNow).decision.cause, decision_t::CAUSE_DUPLICATE);
  EXPECT_TRUE(Decide(BatchOf({kGood}, 3)).certified) << "what was not decided on is not used";
}

TEST_F(GateBatchTest, LooksForACertificateForHalfOfTheBudget) {
  const std::vector<double> accelerations(9, kCollides);
  std::int64_t now = kNow;
  const auto clock = [&] { return std::exchange(now, now + 500); };  // a plan in half a millisecond of five
  const GateAnswer answer = gate_.Decide(Encode(BatchOf(accelerations)), clock);
  EXPECT_FIELDS(answer.decision, (utime, kNow), (outcome, decision_t::ABSTAIN_SAFETY));
  EXPECT_THAT(GetText(answer.decision.message), StartsWith("none of 9 (not judged 5, obstacle 4); the first: "));
}

TEST_F(GateBatchTest, ItsStartIsReadWhereItLies) {
  const candidate_batch_t batch = BatchOf({kGood, kGood});
  EXPECT_EQ(StartOf(Encode(batch)), batch.start_utime);
}

}  // namespace forereach::gate_batch_test
