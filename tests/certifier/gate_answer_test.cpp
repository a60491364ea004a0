// The gate's answer to an admitted candidate: outcomes, witnesses, digests, slices, counts.
#include "tests/test.h"

#include "certifier/gate/candidate_message.h"
#include "certifier/gate/gate.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/text_model.h"
#include "lcmtypes/seal.h"
#include "task/step_time.h"
#include "tests/certifier/small_task.h"
#include "tests/oracle/random.h"
#include "tests/text_models.h"

namespace forereach::gate_answer_test {

struct GateAnswerTest : testing::Test {
  GateAnswer Decide(const candidate_plan_t& candidate) { return gate_.Decide(Encode(candidate), kNow); }

  Config config_ = SmallTask();
  Gate gate_{config_};
};

TEST(GateNoStop, APlanThatEndsMovingIsAbstainedFrom) {
  Config config = SmallTask();
  Own(config.problem).rest = {{2, 0.1}};
  Gate gate(config);
  const GateAnswer moving = gate.Decide(Encode(Candidate(1)), kNow);
  EXPECT_FIELDS(moving.decision, (outcome, decision_t::ABSTAIN_DOMAIN), (cause, decision_t::CAUSE_NO_STOP), (step, 10),
                (coordinate, 2));
  EXPECT_NEAR(moving.decision.margin, 1.05, 1e-9);
  EXPECT_EQ(moving.decision.threshold, 0.1);
  EXPECT_THAT(GetText(moving.decision.message), HasSubstr("at step 10 the plan ends, and vx reaches 1.05"));
  EXPECT_FALSE(moving.certified);
  candidate_plan_t brakes = Candidate(2);
  for (int t = 0; t < 10; ++t) brakes.control[t][0] = -1 / 1.5;
  EXPECT_TRUE(gate.Decide(Encode(brakes), kNow).certified);
}

// Two gates hear the same; one of them also repeats its last certificate at any time.
TEST(GateKeepWarm, ChangesNoBitOfALaterAnswer) {
  Config config = SmallTask();
  Gate plain(config);
  config.realtime.keep_warm = true;
  Gate warm(config);
  std::map<int, int> causes;
  Random random(20261128);
  for (int i = 1; i <= 300; ++i) {
    SCOPED_TRACE(i);
    candidate_plan_t candidate = Candidate(random.Integer(1, i), 0, kNow + i);
    for (int t = 0; t < candidate.num_steps; ++t) candidate.control[t][0] = random.Uniform(-0.5, 0.5);
    if (random.Coin(0.1)) candidate.num_steps = static_cast<std::int16_t>(random.Integer(-1, 12));
    if (random.Coin(0.2)) candidate.control[random.Below(10)][1] = random.Uniform(-9, 9);
    const std::vector<std::uint8_t> bytes = Encode(candidate);
    for (int k = random.Below(3); k > 0; --k) warm.KeepWarm();
    const GateAnswer a = plain.Decide(bytes, kNow + i), b = warm.Decide(bytes, kNow + i);
    EXPECT_EQ(Encode(a.decision), Encode(b.decision));
    ASSERT_EQ(a.certified.has_value(), b.certified.has_value());
    if (a.certified) EXPECT_EQ(Encode(*a.certified), Encode(*b.certified));
    EXPECT_EQ(Encode(plain.Status(kNow)), Encode(warm.Status(kNow)));
    ++causes[a.decision.cause];
  }
  EXPECT_GE(causes.size(), 4u);
  EXPECT_GT(causes[0], 20) << "certificates";
}

TEST(GateLimit, AbstainsFromAPlanThatMayExceedALimit) {
  Config config = SmallTask();
  Own(config.problem).limits = {{.name = "height", .that = {"py", 1, 1}, .at_most = 9},
                                {.name = "speed squared", .that = {"vx^2 + vy^2", 1, 1}, .at_most = 1}};
  Gate gate(config);
  const GateAnswer fast = gate.Decide(Encode(Candidate(1)), kNow);
  EXPECT_FIELDS(fast.decision, (outcome, decision_t::ABSTAIN_SAFETY), (cause, decision_t::CAUSE_LIMIT), (step, 0),
                (coordinate, 1), (obstacle, -1));
  EXPECT_GT(fast.decision.margin, 1);
  EXPECT_EQ(fast.decision.threshold, 1);
  EXPECT_THAT(GetText(fast.decision.message), HasSubstr("at step 0 speed squared may reach 1."));
  EXPECT_FALSE(fast.certified);
  candidate_plan_t slow = Candidate(2);
  slow.initial_center[2] = 0.5;
  EXPECT_TRUE(gate.Decide(Encode(slow), kNow).certified);
}

template <class Message>
void ExpectDigestsOf(const Config& config, const Message& message) {
  EXPECT_EQ(GetDigest(message.config_digest), config.grounds.config);
  EXPECT_EQ(GetDigest(message.model_digest), config.grounds.model);
  EXPECT_EQ(GetDigest(message.declaration_digest), config.grounds.declaration);
  EXPECT_EQ(GetDigest(message.observations_digest), config.grounds.observations);
  EXPECT_EQ(GetDigest(message.obstacles_digest), config.grounds.obstacles);
}

TEST_F(GateAnswerTest, CertifiesAGoodPlanWithEveryFieldSet) {
  const candidate_plan_t candidate = Candidate(7);
  const GateAnswer answer = Decide(candidate);
  const decision_t& decision = answer.decision;
  EXPECT_FIELDS(decision, (outcome, decision_t::CERTIFIED), (cause, decision_t::CAUSE_NONE), (step, -1),
                (coordinate, -1));
  EXPECT_EQ(decision.obstacle, 0) << "the closest";
  EXPECT_GT(decision.margin, decision.threshold);
  EXPECT_EQ(decision.threshold, 0.5) << "the circle's radius";
  EXPECT_FIELDS(decision, (utime, kNow), (plan_id, 7), (candidate_utime, candidate.utime));
  EXPECT_EQ(GetText(decision.source), "test");
  EXPECT_THAT(GetText(decision.message), HasSubstr("certified"));
  EXPECT_EQ(GetDigest(decision.plan_digest), PlanDigest(candidate));
  ExpectDigestsOf(config_, decision);

  ASSERT_TRUE(answer.certified);
  const certified_plan_t& certified = *answer.certified;
  EXPECT_FIELDS(certified, (utime, kNow), (expires_utime, kNow + 2'000'000));
  EXPECT_EQ(Encode(certified.plan), Encode(candidate));
  EXPECT_EQ(GetDigest(certified.plan_digest), PlanDigest(candidate));
  EXPECT_THAT(FindSealFaults(certified), IsEmpty());
  ExpectDigestsOf(config_, certified);
  EXPECT_EQ(GetDigest(certified.transitions_digest), config_.grounds.observations);
}

TEST_F(GateAnswerTest, ACertifiedPlanSaysWhatItsGuardHasToUphold) {
  for (const auto& [step_error_ms, step_error_us] : {std::pair(kAnyTime, -1), {0.0, 0}, {5.0, 5000}}) {
    Own(config_.problem).declaration.state_error = Eigen::Vector4d(0.01, 0, 0.02, 0);
    config_.gate.step_error_ms = step_error_ms;
    const GateAnswer answer = Gate(config_).Decide(Encode(Candidate(7)), kNow);
    ASSERT_TRUE(answer.certified);
    EXPECT_EQ(answer.certified->step_error_us, step_error_us);
    EXPECT_THAT(std::vector(answer.certified->state_error, answer.certified->state_error + 5),
                ElementsAre(0.01, 0, 0.02, 0, 0));
    EXPECT_THAT(FindSealFaults(*answer.certified), IsEmpty());
  }
}

TEST_F(GateAnswerTest, ACertificateNamesTheTransitionsOfTheTaskWithoutWhatWasLearned) {
  Gate gate(config_);
  const transition_t learned = AtRest(kNow);
  ASSERT_EQ(gate.Learn(Encode(learned)), "");
  const GateAnswer answer = gate.Decide(Encode(Candidate(7)), kNow);
  ASSERT_TRUE(answer.certified);
  EXPECT_EQ(GetDigest(answer.certified->transitions_digest), config_.grounds.observations);
  EXPECT_EQ(GetDigest(answer.certified->observations_digest),
            ChainedDigest(config_.grounds.observations, Encode(learned)));
}

TEST_F(GateAnswerTest, AbstainsForAnObstacleAndNamesIt) {
  const GateAnswer answer = Decide(Candidate(1, kAccelerationIntoTheCircle));
  const decision_t& decision = answer.decision;
  EXPECT_FIELDS(decision, (outcome, decision_t::ABSTAIN_SAFETY), (cause, decision_t::CAUSE_OBSTACLE), (obstacle, 0));
  EXPECT_GT(decision.step, 0);
  EXPECT_LE(decision.step, 10);
  EXPECT_LE(decision.margin, decision.threshold);
  EXPECT_FALSE(answer.certified);
  ExpectDigestsOf(config_, decision);
}

TEST_F(GateAnswerTest, AControlOutsideTheInputDomainIsAnAbstentionNotARejection) {
  candidate_plan_t candidate = Candidate(1);
  candidate.control[3][1] = 3;  // the bound is inside
  EXPECT_EQ(Decide(candidate).decision.cause, decision_t::CAUSE_NONE);
  candidate.plan_id = 2;
  candidate.control[3][1] = std::nextafter(3.0, 4.0);
  const GateAnswer answer = Decide(candidate);
  EXPECT_FIELDS(answer.decision, (outcome, decision_t::ABSTAIN_DOMAIN), (cause, decision_t::CAUSE_DOMAIN_EXIT),
                (step, 3));
  EXPECT_EQ(answer.decision.coordinate, 5) << "inputs follow the four states";
  EXPECT_FIELDS(answer.decision, (margin, std::nextafter(3.0, 4.0)), (threshold, 3));
  EXPECT_FALSE(answer.certified);
}

TEST_F(GateAnswerTest, NamesTheDomainWhereSafetyFailsToo) {
  EXPECT_EQ(Decide(Candidate(1, kAccelerationOutsideDomain)).decision.outcome, decision_t::ABSTAIN_DOMAIN);
}

TEST_F(GateAnswerTest, ContradictingDataGiveFWithThePair) {
  Gate gate(FalsifiedTask());
  for (const double acceleration :
       {kAccelerationThatCertifies, kAccelerationIntoTheCircle, kAccelerationOutsideDomain}) {
    const GateAnswer answer = gate.Decide(Encode(Candidate(static_cast<int>(acceleration) + 1, acceleration)), kNow);
    EXPECT_FIELDS(answer.decision, (outcome, decision_t::ABSTAIN_FALSIFIED), (cause, decision_t::CAUSE_PAIRWISE),
                  (first_observation, 0), (second_observation, 1), (coordinate, 2));
    EXPECT_NEAR(answer.decision.margin, 0.01, 1e-12);
    EXPECT_FALSE(answer.certified);
  }
}

TEST_F(GateAnswerTest, EveryCandidateIsAnsweredOnceAndCounted) {
  std::vector<std::vector<std::uint8_t>> sent;
  for (int round = 0; round < 10; ++round) {
    sent.push_back(Encode(Candidate(3 * round)));
    sent.push_back(Encode(Candidate(3 * round)));  // duplicate
    sent.push_back({1, 2, 3});
    sent.push_back(Encode(Candidate(3 * round + 1, kAccelerationIntoTheCircle)));
    sent.push_back(Encode(Candidate(3 * round + 2, kAccelerationOutsideDomain)));
  }
  std::int64_t sequence = 0, certificates = 0;
  for (const auto& bytes : sent) {
    const GateAnswer answer = gate_.Decide(bytes, kNow);
    EXPECT_EQ(answer.decision.sequence, sequence++);
    EXPECT_EQ(GetDigest(answer.decision.plan_digest), PlanDigest(Bytes(bytes)));
    if (answer.certified) EXPECT_EQ(answer.certified->sequence, certificates++);
  }
  const certifier_status_t status = gate_.Status(kNow + 5);
  EXPECT_FIELDS(status, (utime, kNow + 5), (candidates, 50), (by_outcome[decision_t::CERTIFIED], 10),
                (by_outcome[decision_t::ABSTAIN_FALSIFIED], 0), (by_outcome[decision_t::ABSTAIN_DOMAIN], 10),
                (by_outcome[decision_t::ABSTAIN_SAFETY], 10), (by_outcome[decision_t::REJECTED], 20));
  EXPECT_EQ(certificates, 10);
  ExpectDigestsOf(config_, status);
}

TEST_F(GateAnswerTest, AnErrorAfterTheProofLeavesNoCertificate) {
  int calls = 0;
  const Gate::TimeSource fails_after_the_proof = [&] {
    if (++calls > 1) throw std::runtime_error("the clock is gone");
    return kNow;
  };
  const GateAnswer answer = gate_.Decide(Encode(Candidate(1)), fails_after_the_proof);
  EXPECT_EQ(calls, 2);
  EXPECT_FALSE(answer.certified);
  EXPECT_FIELDS(answer.decision, (outcome, decision_t::REJECTED), (cause, decision_t::CAUSE_INTERNAL_ERROR));
  EXPECT_EQ(gate_.Status(kNow).by_outcome[decision_t::CERTIFIED], 0);
}

TEST_F(GateAnswerTest, RejectsPlanIdsThatWereUsedBeforeAReload) {
  ASSERT_TRUE(Decide(Candidate(7)).certified);
  ASSERT_FALSE(Decide(Candidate(8, kAccelerationOutsideDomain)).certified);
  Gate reloaded{config_};
  reloaded.Inherit(gate_);
  for (const std::int64_t used : {7, 8}) {
    const GateAnswer again = reloaded.Decide(Encode(Candidate(used)), kNow);
    EXPECT_EQ(again.decision.cause, decision_t::CAUSE_DUPLICATE) << used;
    EXPECT_FALSE(again.certified);
  }
  const GateAnswer next = reloaded.Decide(Encode(Candidate(9)), kNow);
  ASSERT_TRUE(next.certified);
  EXPECT_FIELDS(next, (decision.sequence, 4), (certified->sequence, 1));
  EXPECT_EQ(reloaded.Status(kNow).candidates, 5);
}

TEST_F(GateAnswerTest, FirstSliceContainsTheInitialSetAndAllAreTheTubesHulls) {
  const candidate_plan_t candidate = Candidate(1);
  const GateAnswer answer = Decide(candidate);
  ASSERT_TRUE(answer.certified);
  for (int k = 0; k < 4; ++k) {
    // Exact: centers and half-widths differ by few binary orders, a long double has 11 bits to spare.
    const long double center = candidate.initial_center[k], half_width = candidate.initial_half_width[k];
    EXPECT_LE(answer.certified->slice_lower[0][k], center - half_width);
    EXPECT_GE(answer.certified->slice_upper[0][k], center + half_width);
    EXPECT_NEAR(answer.certified->slice_upper[0][k], static_cast<double>(center + half_width), 1e-15);
    for (int t = 0; t <= 10; ++t) {
      EXPECT_EQ(answer.certified->slice_lower[t][k], gate_.tube().hull(t, k).lower);
      EXPECT_EQ(answer.certified->slice_upper[t][k], gate_.tube().hull(t, k).upper);
    }
  }
}

TEST_F(GateAnswerTest, SlicesContainRolloutsFromTheCornersOfTheInitialSet) {
  const candidate_plan_t candidate = Candidate(1, 1);
  const GateAnswer answer = Decide(candidate);
  ASSERT_TRUE(answer.certified) << GetText(answer.decision.message);
  for (unsigned corner = 0; corner < 16; ++corner) {
    std::array<double, 6> z{};
    for (unsigned k = 0; k < 4; ++k)  // just inside, by more than the rounding of the rollout
      z[k] = candidate.initial_center[k] + (corner >> k & 1 ? 1 : -1) * (1 - 1e-12) * candidate.initial_half_width[k];
    for (int t = 0; t <= 10; ++t) {
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_LE(answer.certified->slice_lower[t][k], z[k]) << t << " " << k;
        EXPECT_GE(answer.certified->slice_upper[t][k], z[k]) << t << " " << k;
      }
      z[4] = candidate.control[t][0], z[5] = candidate.control[t][1];
      std::array<double, 4> next;
      config_.problem->model->Evaluate(z, next);
      std::ranges::copy(next, z.begin());
    }
  }
}

TEST_F(GateAnswerTest, UnusedSliceEntriesAreZeroEvenAfterALongerPlan) {
  candidate_plan_t longer = Candidate(1);
  longer.num_steps = 14;
  ASSERT_TRUE(Decide(longer).certified);
  const GateAnswer answer = Decide(Candidate(2));
  ASSERT_TRUE(answer.certified);
  for (int t = 0; t <= 128; ++t) {
    for (int k = 0; k < 16; ++k) {
      if (t <= 10 && k < 4) continue;
      ASSERT_EQ(answer.certified->slice_lower[t][k], 0) << t << " " << k;
      ASSERT_EQ(answer.certified->slice_upper[t][k], 0) << t << " " << k;
    }
  }
}

TEST_F(GateAnswerTest, AFlippedBitAnywhereBreaksTheSeal) {
  const GateAnswer answer = Decide(Candidate(1));
  ASSERT_TRUE(answer.certified);
  const std::vector<std::uint8_t> good = Encode(*answer.certified);
  FreshRandom random;
  for (std::size_t i = random() % 7; i < good.size(); i += 7) {
    std::vector<std::uint8_t> bytes = good;
    bytes[i] ^= static_cast<std::uint8_t>(1u << random() % 8);
    const auto tampered = Decoded<certified_plan_t>(bytes);
    ASSERT_EQ(tampered.has_value(), i >= 8) << i;
    if (tampered) ASSERT_THAT(FindSealFaults(*tampered), Not(IsEmpty())) << i;
  }
}

struct GateAdviceTest : GateAnswerTest {
  std::optional<advice_t> AdviceOn(Gate& gate, const candidate_plan_t& candidate, const SearchEffort& effort = {}) {
    decision_ = gate.Decide(Encode(candidate), kNow).decision;
    return gate.Advise(candidate, decision_, effort);
  }

  decision_t decision_{};
};

TEST_F(GateAdviceTest, SaysHowFarAPlanHasToGiveWay) {
  const candidate_plan_t candidate = Candidate(1, kAccelerationIntoTheCircle);
  const auto advice = AdviceOn(gate_, candidate).value();
  EXPECT_FIELDS(advice, (plan_id, 1), (candidate_utime, candidate.utime));
  EXPECT_EQ(GetText(advice.source), "test");
  EXPECT_EQ(GetDigest(advice.plan_digest), PlanDigest(candidate));
  EXPECT_EQ(GroundsOf(advice), gate_.grounds());
  EXPECT_EQ(std::tuple(advice.outcome, advice.cause, advice.num_changes),
            std::tuple(decision_t::ABSTAIN_SAFETY, decision_t::CAUSE_OBSTACLE, 1));
  const advice_change_t& change = advice.change[0];
  EXPECT_EQ(std::tuple(change.kind, change.index, change.verified, change.step),
            std::tuple(advice_change_t::OBSTACLE, 0, 1, decision_.step));
  EXPECT_NEAR(std::hypot(change.direction[0], change.direction[1]), 1, 1e-12);
  EXPECT_EQ(change.direction[2], 0);

  // The plan gives way as told: it begins so much farther in this direction.
  candidate_plan_t moved = candidate;
  moved.plan_id = 2;
  for (int k = 0; k < 2; ++k) moved.initial_center[k] += change.value * change.direction[k];
  EXPECT_TRUE(gate_.Decide(Encode(moved), kNow).certified);
  moved.plan_id = 3;
  for (int k = 0; k < 2; ++k) moved.initial_center[k] -= 0.1 * change.value * change.direction[k];
  EXPECT_FALSE(gate_.Decide(Encode(moved), kNow).certified) << "and not farther than it has to";
}

TEST_F(GateAdviceTest, SaysWhatLeavesTheDomainAndByHowMuch) {
  const auto advice = AdviceOn(gate_, Candidate(1, kAccelerationOutsideDomain)).value();
  EXPECT_EQ(advice.num_changes, 1);
  const advice_change_t& change = advice.change[0];
  EXPECT_EQ(std::tuple(change.kind, change.index, change.verified, change.step),
            std::tuple(advice_change_t::DOMAIN, 4, 0, 0));
  EXPECT_FIELDS(change, (value, 1), (direction[0], -1));
}

TEST_F(GateAdviceTest, SaysHowMuchMoreRoomALimitNeeds) {
  Own(config_.problem).limits = {{.name = "speed squared", .that = {"vx^2 + vy^2", 1, 1}, .at_most = 1}};
  Gate gate(config_);
  const auto advice = AdviceOn(gate, Candidate(1)).value();
  const advice_change_t& change = advice.change[0];
  EXPECT_EQ(std::tuple(change.kind, change.index, change.direction[0]), std::tuple(advice_change_t::LIMIT, 0, -1.0));
  EXPECT_NEAR(change.value, 1.05 * 1.05 + 0.15 * 0.15 - 1, 1e-9);
}

TEST_F(GateAdviceTest, SaysNothingOfACertificateOrUnderOtherGrounds) {
  EXPECT_FALSE(AdviceOn(gate_, Candidate(1)));
  const candidate_plan_t candidate = Candidate(2, kAccelerationIntoTheCircle);
  ASSERT_TRUE(AdviceOn(gate_, candidate));
  decision_t other = decision_;
  other.observations_digest[0] ^= 1;
  EXPECT_FALSE(gate_.Advise(candidate, other, {}));
  other = decision_;
  ++other.step;
  EXPECT_FALSE(gate_.Advise(candidate, other, {}));
  candidate_plan_t wrong = candidate;  // that anybody could ask about
  wrong.num_steps = 129;
  EXPECT_FALSE(gate_.Advise(wrong, decision_, {}));
  wrong.num_steps = -1;
  EXPECT_FALSE(gate_.Advise(wrong, decision_, {}));
  wrong.num_steps = 10, wrong.initial_half_width[0] = -1;
  EXPECT_FALSE(gate_.Advise(wrong, decision_, {}));
}

TEST_F(GateAdviceTest, StopsItsSearchWhenAsked) {
  const candidate_plan_t candidate = Candidate(1, kAccelerationIntoTheCircle);
  int asked = 0;
  ASSERT_TRUE(AdviceOn(gate_, candidate, {4, [&] { return ++asked > 0; }}));
  for (int most = 0; most < asked; ++most) {
    int count = 0;
    EXPECT_FALSE(gate_.Advise(candidate, decision_, {4, [&] { return ++count <= most; }})) << most;
    EXPECT_EQ(count, most + 1) << "nothing is tried after that";
  }
}

TEST(GateTransitionTest, ARefusedTransitionNamesTheFailedCheckAndChangesNothing) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  Config config = SmallTask();
  config.gate.learns = true;
  Gate gate(config);
  const transition_t good = AtRest(kNow);
  const auto expect_refused = [&](auto change, const char* why) {
    transition_t bad = good;
    change(bad);
    EXPECT_THAT(gate.Learn(Encode(bad)), HasSubstr(why));
    EXPECT_EQ(gate.grounds().observations, config.grounds.observations);
  };
  expect_refused([](auto& t) { t.num_states = 5; }, "5 states and 2 inputs, the task has 4 and 2");
  expect_refused([](auto& t) { t.num_inputs = -1; }, "4 states and -1 inputs");
  expect_refused([](auto& t) { t.state[3] = kNaN; }, "NaN or infinity");
  expect_refused([](auto& t) { t.next_state[0] = HUGE_VAL; }, "NaN or infinity");
  expect_refused([](auto& t) { t.state[0] = 20.5; }, "outside the certification domain");
  expect_refused([](auto& t) { t.input[1] = -3.5; }, "outside the certification domain");
  EXPECT_EQ(gate.Learn(Encode(good)), "");
  EXPECT_NE(gate.grounds().observations, config.grounds.observations);
}

// The small task's model in numbers of a step of its dt, which do not say what others do.
Config TaskOfNumbers() {
  Config config = SmallTask();
  Own(config.problem).model = MakeTextModel(
      TextModel({{"px", "px + 0.15*vx"}, {"py", "py + 0.15*vy"}, {"vx", "vx + 0.15*ax"}, {"vy", "vy + 0.15*ay"}},
                {"ax", "ay"}, {{"dt", 0.15, 0.15}}));
  return config;
}

// A step of another duration shows nothing of a step of dt, 150 ms, unless the task says how it differs.
TEST(GateTransitionTest, AStepThatNoScheduleAllowsIsNotLearned) {
  const auto learn = [](std::optional<double> step_error_ms, std::int64_t duration_us, bool has_equations = true) {
    Config config = has_equations ? SmallTask() : TaskOfNumbers();
    config.gate.learns = true;
    config.gate.step_error_ms = step_error_ms;
    Own(config.problem).timing.error = StepErrorSeconds(config);
    transition_t transition = AtRest(kNow);
    transition.duration_us = duration_us;
    Gate gate(config);
    const std::string refusal = gate.Learn(Encode(transition));
    const bool is_learned = gate.grounds().observations != config.grounds.observations;
    EXPECT_FALSE(is_learned && !refusal.empty());
    return refusal.empty() && !is_learned ? "not learned" : refusal;
  };
  EXPECT_EQ(learn(0, 150'000), "");
  for (const std::int64_t other : {149'998, 150'002, 100'000, 0, -150'000}) {
    EXPECT_THAT(learn(0, other), HasSubstr(" us, further from model.dt, 0.15 s, than steps on time do"));
    for (const std::optional<double> no_clock : {std::optional(kAnyTime), std::optional<double>()}) {
      EXPECT_EQ(learn(no_clock, 150'000, false), "");
      EXPECT_EQ(learn(no_clock, other, false), "not learned") << "and not refused";
      EXPECT_EQ(learn(no_clock, other), other > 75'000 ? "" : "not learned") << "the equations know time";
    }
  }
  // (1 + x / dt)^2 < 2, else the residual may have doubled.
  for (const std::int64_t within : {212'130, 87'870}) EXPECT_EQ(learn(kAnyTime, within), "");
  for (const std::int64_t beyond : {212'132, 87'868, 225'000, 75'000})
    EXPECT_EQ(learn(kAnyTime, beyond), "not learned");
  for (const std::int64_t within : {160'000, 140'000}) EXPECT_EQ(learn(5, within), "");
  for (const std::int64_t beyond : {160'002, 139'998})
    EXPECT_THAT(learn(5, beyond), HasSubstr(" us, further from model.dt, 0.15 s, than two errors of 0.005 s"));
  EXPECT_THAT(learn(5, INT64_MAX), HasSubstr("two errors"));
}

// A robot whose states are recorded with an error of 1/4: at 19.75 m the domain's edge is just reached.
TEST(GateTransitionTest, ATransitionThatItsErrorsMayTakeOutOfTheDomainIsNotLearned) {
  Config config = SmallTask();
  config.gate.learns = true;
  Own(config.problem).declaration.state_error = Eigen::Vector4d(0.25, 0, 0, 0);
  Gate gate(config);
  transition_t transition = AtRest(kNow);
  const auto at = [&](double px) {
    transition.state[0] = transition.next_state[0] = px;
    return gate.Learn(Encode(transition));
  };
  EXPECT_EQ(at(19.75), "");
  EXPECT_THAT(at(std::nextafter(19.75, 20)),
              HasSubstr("within the declared errors of states and inputs it may lie outside"));
}

TEST(CandidateMessageTest, TheStartIsReadFromTheBytesAsADecoderReadsIt) {
  for (const std::int64_t start : {std::int64_t{0}, kNow, std::int64_t{-1}, INT64_MIN, INT64_MAX}) {
    candidate_plan_t candidate = Candidate(7);
    candidate.start_utime = start;
    EXPECT_EQ(StartOf(Encode(candidate)), start);
  }
  std::vector<std::uint8_t> bytes = Encode(Candidate(7));
  for (std::size_t size : {std::size_t{0}, std::size_t{7}, std::size_t{8}, bytes.size() - 1})
    EXPECT_EQ(StartOf(Bytes(bytes).first(size)), INT64_MAX) << size;
  bytes[0] ^= 1;
  EXPECT_EQ(StartOf(bytes), INT64_MAX) << "of another type";
  bytes[0] ^= 1;
  bytes.push_back(0);
  EXPECT_EQ(StartOf(bytes), INT64_MAX);
}

}  // namespace forereach::gate_answer_test
