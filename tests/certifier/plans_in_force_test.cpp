// The ledger of certified plans: they are judged again, how many controls stand, and when withdrawals are sent.
#include "certifier/gate/plan_ledger.h"

#include <fmt/format.h>

#include "tests/test.h"

#include "tests/certifier/small_task.h"

namespace forereach::plans_in_force_test {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr int kSteps = 10;  // of Candidate

struct PlansInForceTest : testing::Test {
  PlansInForceTest() { SeeAndJudge({}); }

  std::string See(const std::vector<Obstacle>& obstacles) {
    return gate_.UpdateObstacles(Encode(Sighted(obstacles, now_, sequence_++)), now_);
  }
  void SeeAndJudge(const std::vector<Obstacle>& obstacles) {
    EXPECT_EQ(See(obstacles), "");
    plans_.Judge(gate_, now_);
  }
  // Unsafe where px >= offset.
  void SeeWall(double offset) { SeeAndJudge({Obstacle::HalfSpace(Eigen::Vector2d(1, 0), offset)}); }
  certified_plan_t Certify(std::int64_t plan_id, const char* source = "test") {
    candidate_plan_t candidate = Candidate(plan_id, kAccelerationThatCertifies, now_);
    SetText(candidate.source, source);
    const GateAnswer answer = gate_.Decide(Encode(candidate), now_);
    EXPECT_TRUE(answer.certified) << GetText(answer.decision.message);
    plans_.Add(answer.certified.value(), now_);
    return *answer.certified;
  }
  // The task with a domain that the plan just leaves at a step.
  Config NarrowerFrom(const certified_plan_t& plan, int step) const {
    return Another([&](Config&, Problem& problem) {
      Eigen::VectorXd upper = problem.domain.state.upper();
      upper(0) = Reach(plan, step) - 1e-9;
      problem.domain.state = Box(problem.domain.state.lower(), upper);
    });
  }
  // Another task: this one with a change.
  template <class Change>
  Config Another(Change change) const {
    static int number = 0;
    Config config = config_;
    change(config, Own(config.problem));
    config.grounds.config = DigestOf("task " + std::to_string(++number));
    return config;
  }
  // What comes of judging the plans under another task.
  std::optional<withdrawal_t> DueUnder(const Config& task) {
    Gate gate(task);
    gate.Inherit(gate_);
    plans_.Judge(gate, now_);
    return Due();
  }
  robot_state_t State(std::int64_t plan_id, int step) { return StateOf(now_, states_++, plan_id, step); }
  void SeeRobot(std::int64_t plan_id, int step) { plans_.SeeRobot(State(plan_id, step), now_); }
  void Answer(std::int64_t plan_id, int step, double value) {
    plans_.TakeAnswer({.plan_id = plan_id,
                       .kind = execution_event_t::WITHDRAWN,
                       .step = static_cast<std::int16_t>(step),
                       .value = value});
  }
  std::optional<withdrawal_t> Due() { return DueOf(plans_); }
  std::optional<withdrawal_t> DueOf(PlanLedger& plans) const {
    const auto due = plans.TakeDue(now_, now_);
    return due ? std::optional(due->message) : std::nullopt;
  }
  // The withdrawal of a plan that was certified under one task, as this is read again and is another.
  std::optional<withdrawal_t> WithdrawnByReload(const Config& before, const Config& after) {
    Gate gate(before);
    PlanLedger plans(config_.gate, now_);
    EXPECT_EQ(gate.UpdateObstacles(Encode(Sighted({}, now_, sequence_++)), now_), "");
    plans.Judge(gate, now_);
    plans.Add(gate.Decide(Encode(Candidate(1, kAccelerationThatCertifies, now_)), now_).certified.value(), now_);
    Gate reloaded(after);
    reloaded.Inherit(gate);
    plans.Judge(reloaded, now_);
    return DueOf(plans);
  }
  // The greatest px of slice t of the plan, by its certificate.
  static double Reach(const certified_plan_t& certified, int t) { return certified.slice_upper[t][0]; }

  std::int64_t now_ = kNow, sequence_ = 0, states_ = 0;
  Config config_ = SmallTaskOnTheBus();
  Gate gate_{config_};
  PlanLedger plans_{config_.gate, kNow};
};

TEST_F(PlansInForceTest, AWallLeavesTheControlsBeforeTheFirstSliceThatMayTouchIt) {
  for (int t = 1; t <= kSteps; ++t) {
    const certified_plan_t plan = Certify(t);
    // 1e-9: the separation's own rounding
    SeeWall(Reach(plan, t) + 1e-9);
    const auto just_outside = Due();
    if (t == kSteps) {
      EXPECT_FALSE(just_outside) << "it stays clear of it, so it stands";
    } else {
      ASSERT_TRUE(just_outside);
      EXPECT_FIELDS(*just_outside, (step, t + 1), (valid_steps, t));
    }
    SeeWall(Reach(plan, t) - 1e-9);
    EXPECT_FIELDS(Due().value(), (step, t), (valid_steps, t - 1));
    plans_.StandBy();
    SeeAndJudge({});
  }
}

// The motion under control t ends at sample t + 1, so the step that fails is the first control that does not stand.
TEST_F(PlansInForceTest, WithdrawsFromTheStepWhoseMotionMayTouchBetweenSamples) {
  Own(config_.problem).between = Between{Eigen::Vector2d(8, 8), 0, 0, 0.15};
  const double bulge = 8 * 0.15 * 0.15 / 8;
  for (int t = 1; t <= kSteps; ++t) {
    Gate gate(config_);
    PlanLedger plans(config_.gate, now_);
    const auto see = [&](double wall) {
      const obstacles_t seen = Sighted({Obstacle::HalfSpace(Eigen::Vector2d(1, 0), wall)}, now_, sequence_++);
      EXPECT_EQ(gate.UpdateObstacles(Encode(seen), now_), "");
      plans.Judge(gate, now_);
      return DueOf(plans);
    };
    see(15);
    const auto certified = gate.Decide(Encode(Candidate(t, kAccelerationThatCertifies, now_)), now_).certified.value();
    plans.Add(certified, now_);
    const auto outside = see(Reach(certified, t) + bulge + 1e-9);
    EXPECT_EQ(outside ? outside->valid_steps : kSteps, t);
    EXPECT_FIELDS(see(Reach(certified, t) + bulge - 1e-9).value(), (step, t - 1), (valid_steps, t - 1));
  }
}

// The robot goes on in the steps of the plan, and neither model nor bounds of the new task are about these.
TEST_F(PlansInForceTest, WithdrawsEveryStepUnderATaskOfAShorterPeriod) {
  for (const bool is_bounded : {true, false}) {
    const auto with_period = [&](double period) {
      return Another([&](Config& config, Problem& problem) {
        problem.model = MakePointMass(period);
        if (is_bounded) problem.between = Between{Eigen::Vector2d(1, 1), 0, 0, period};
        if (!is_bounded) config.gate.max_clock_error_ms = 10;
        config.gate.longest_step_ms = period * 1e3;
        config.gate.step_us = std::llround(period * 1e6);
      });
    };
    const auto due = WithdrawnByReload(with_period(0.15), with_period(0.1)).value();
    EXPECT_FIELDS(due, (cause, withdrawal_t::NOT_JUDGED), (valid_steps, 0));
  }
}

// The guard goes on by the plan, under whatever task the certifier is.
TEST_F(PlansInForceTest, APlanStandsUnderANewTaskOnlyIfItsGuardUpholdsWhatThatRestsOn) {
  const auto with = [&](double step_error_ms, double error_of_py) {
    return Another([&](Config& config, Problem& problem) {
      problem.declaration.state_error[1] = error_of_py;
      config.gate.step_error_ms = step_error_ms;
    });
  };
  struct {
    double before_ms, after_ms, before_m, after_m;
    bool stands;
  } const cases[] = {{5, 5.001, 0, 0, true},
                     {5, 4.999, 0, 0, false},
                     {5, kAnyTime, 0, 0, true},
                     {kAnyTime, 5, 0, 0, false},
                     {kAnyTime, kAnyTime, 0.01, 0.0099, true},
                     {5, 6, 0.01, 0.0101, false}};
  for (const auto& [before_ms, after_ms, before_m, after_m, stands] : cases) {
    SCOPED_TRACE(fmt::format("{} {} {} {}", before_ms, after_ms, before_m, after_m));
    const auto due = WithdrawnByReload(with(before_ms, before_m), with(after_ms, after_m));
    EXPECT_EQ(due.has_value(), !stands);
    if (!due) continue;
    EXPECT_FIELDS(*due, (cause, withdrawal_t::NOT_JUDGED), (valid_steps, 0));
  }
}

TEST_F(PlansInForceTest, AWithdrawalNamesThePlanTheWitnessAndWhatItRestsOn) {
  const certified_plan_t plan = Certify(3);
  now_ += 1000;
  SeeWall(Reach(plan, 6) - 1e-9);
  const withdrawal_t message = Due().value();
  EXPECT_FIELDS(message, (utime, now_), (sequence, 0), (plan_id, 3));
  EXPECT_EQ(GetText(message.source), "test");
  EXPECT_FIELDS(message, (expires_utime, plan.expires_utime), (cause, withdrawal_t::OBSTACLE), (first_step, 0));
  EXPECT_EQ(message.obstacle, 1) << "after that of the task";
  EXPECT_LE(message.margin, message.threshold);
  EXPECT_EQ(GetDigest(message.plan_digest), GetDigest(plan.plan_digest));
  EXPECT_EQ(GetDigest(message.certificate_digest), GetDigest(plan.certificate_digest));
  EXPECT_EQ(GroundsOf(message), gate_.grounds());
  EXPECT_NE(GroundsOf(message).obstacles, GroundsOf(plan).obstacles);
  EXPECT_THAT(GetText(message.message), HasSubstr("the first 5 controls stand; now abstain S: at step 6"));
  EXPECT_EQ(plans_.withdrawals(), 1);
}

TEST_F(PlansInForceTest, DoesNotJudgeStepsThatArePast) {
  const Obstacle behind = Obstacle::Circle(Eigen::Vector2d(0.15 * 3, 0.03), 0.01);
  Certify(1);
  SeeRobot(1, 6);
  SeeAndJudge({behind});
  EXPECT_FALSE(Due());
  plans_.StandBy();
  SeeAndJudge({});
  Certify(2);
  SeeRobot(2, 3);
  SeeAndJudge({behind});
  const withdrawal_t message = Due().value();
  EXPECT_EQ(message.first_step, 3);
  EXPECT_EQ(message.step, 3) << "the robot may be there";
  EXPECT_EQ(message.valid_steps, 2);
}

TEST_F(PlansInForceTest, RepeatsAWithdrawalUntilItIsAnswered) {
  Certify(1);
  SeeWall(1);
  const withdrawal_t first = Due().value();
  EXPECT_FALSE(Due());
  now_ += PlanLedger::kRepeatUs - 1;
  EXPECT_FALSE(Due());
  now_ += 1;
  EXPECT_FIELDS(Due().value(), (sequence, first.sequence + 1), (valid_steps, first.valid_steps));
  EXPECT_EQ(plans_.withdrawals(), 1);
  now_ += PlanLedger::kRepeatUs;
  Answer(2, 0, 0);                      // another plan's
  Answer(1, first.valid_steps + 1, 0);  // the guard lets more stand
  Answer(1, first.valid_steps, -1);     // an answer to an earlier withdrawal
  Answer(1, first.valid_steps, 2);      // to none that was sent
  Answer(1, first.valid_steps, std::nan(""));
  EXPECT_TRUE(Due());
  Answer(1, first.valid_steps, 1);
  now_ += PlanLedger::kRepeatUs;
  EXPECT_FALSE(Due());
}

// The guard has one of them. Its answer for the other must not silence the message that it needs.
TEST_F(PlansInForceTest, PlansOfTwoSourcesWithOneIdAreAnsweredEachForItself) {
  Certify(1, "one");
  Certify(1, "another");
  SeeRobot(1, 0);
  SeeWall(1);
  const withdrawal_t lost = Due().value(), heard = Due().value();
  ASSERT_NE(GetDigest(lost.certificate_digest), GetDigest(heard.certificate_digest));
  Answer(1, 0, static_cast<double>(heard.sequence));
  now_ += PlanLedger::kRepeatUs;
  const withdrawal_t repeated = Due().value();
  EXPECT_EQ(GetDigest(repeated.certificate_digest), GetDigest(lost.certificate_digest));
  EXPECT_FALSE(Due());
  Answer(1, 0, static_cast<double>(repeated.sequence));
  now_ += PlanLedger::kRepeatUs;
  EXPECT_FALSE(Due());
}

TEST_F(PlansInForceTest, NeverRestoresStepsAndWithdrawsAgainWhenFewerStand) {
  const certified_plan_t plan = Certify(1);
  SeeWall(Reach(plan, 6) - 1e-9);
  EXPECT_EQ(Due()->valid_steps, 5);
  Answer(1, 5, 0);
  SeeWall(15);  // the wall was none
  EXPECT_FALSE(Due());
  SeeWall(Reach(plan, 8) - 1e-9);
  EXPECT_FALSE(Due());
  SeeWall(Reach(plan, 4) - 1e-9);
  EXPECT_EQ(Due().value().valid_steps, 3);
  Answer(1, 3, 0);  // the late answer to the first
  now_ += PlanLedger::kRepeatUs;
  EXPECT_TRUE(Due());
}

TEST_F(PlansInForceTest, WithdrawsNothingWhileThePlanStaysValid) {
  const certified_plan_t plan = Certify(1);
  SeeAndJudge({});
  EXPECT_FALSE(Due());
  SeeWall(Reach(plan, kSteps) + 0.5);
  EXPECT_FALSE(Due()) << "a plan that stays valid gets no message";
}

TEST_F(PlansInForceTest, APlanThatCannotBeExecutedAnyMoreIsForgotten) {
  Certify(1);
  Certify(2);
  EXPECT_EQ(plans_.num_in_force(), 2u);
  SeeRobot(1, 0);
  EXPECT_EQ(plans_.num_in_force(), 2u);
  SeeRobot(2, 0);
  EXPECT_EQ(plans_.num_in_force(), 1u) << "the guard has left plan 1";
  SeeRobot(-1, -1);
  EXPECT_EQ(plans_.num_in_force(), 0u);
  Certify(3);
  SeeRobot(-1, -1);
  EXPECT_EQ(plans_.num_in_force(), 1u) << "it may be pending";
  now_ += 60'000'000;
  SeeRobot(-1, -1);
  EXPECT_EQ(plans_.num_in_force(), 0u) << "it has expired";
}

TEST_F(PlansInForceTest, ALateStateChangesNothing) {
  Certify(1);
  states_ = 5;
  SeeRobot(1, 4);
  states_ = 3;
  SeeRobot(-1, -1);
  EXPECT_EQ(plans_.num_in_force(), 1u);
}

TEST_F(PlansInForceTest, AWithdrawalIsNotSentAfterThePlansEnd) {
  Certify(1);
  SeeWall(1);
  EXPECT_TRUE(Due());
  now_ += 60'000'000;
  EXPECT_FALSE(Due());
}

TEST_F(PlansInForceTest, OfManyPendingPlansTheNewestAreJudgedAndTheOthersWithdrawnWhole) {
  const int many = static_cast<int>(PlanLedger::kJudged) + 1;
  for (int id = 1; id <= many; ++id) Certify(id);
  SeeWall(15);  // none of them comes near
  EXPECT_FIELDS(Due().value(), (plan_id, 1), (cause, withdrawal_t::NOT_JUDGED), (valid_steps, 0));
  EXPECT_FALSE(Due());
}

TEST_F(PlansInForceTest, TheExecutingPlanIsJudgedHoweverManyArePending) {
  Certify(1);
  SeeRobot(1, 0);
  for (int id = 2; id <= static_cast<int>(PlanLedger::kJudged) + 1; ++id) Certify(id);
  SeeWall(15);
  EXPECT_FALSE(Due());
}

// ---- Two robots under one name.

TEST_F(PlansInForceTest, APlanThatTwoMayExecuteIsJudgedFromTheEarlierStepAndLeavesWithItsTime) {
  const certified_plan_t plan = Certify(1);
  SeeRobot(1, 5);
  plans_.SeeOneOfTwo(State(1, 2), now_);
  SeeRobot(1, 6);
  SeeWall(Reach(plan, 4) - 1e-9);
  const withdrawal_t message = Due().value();
  EXPECT_FIELDS(message, (first_step, 2), (valid_steps, 3));
  Answer(1, 0, static_cast<double>(message.sequence));
  SeeRobot(-1, -1);
  SeeRobot(2, 0);
  robot_state_t finished = State(-1, -1);
  finished.mode = robot_state_t::FINISHED;
  plans_.SeeRobot(finished, now_);
  const std::int64_t run = 2 * 500'000 + kSteps * 150'000;
  now_ += run;
  EXPECT_EQ(Due().value().plan_id, 1) << "the other one may execute it still";
  now_ += 1;
  SeeRobot(-1, -1);
  EXPECT_EQ(plans_.num_in_force(), 0u);
}

TEST_F(PlansInForceTest, OneOfTwoEndsNothing) {
  Certify(1);
  Certify(2);
  SeeRobot(1, 3);
  plans_.SeeOneOfTwo(State(-1, -1), now_);
  plans_.SeeOneOfTwo(State(2, 0), now_);
  EXPECT_EQ(plans_.num_in_force(), 2u);
}

TEST_F(PlansInForceTest, ThePlanOfTheRobotBeforeLeavesWithItsTimeAndAnothersStatesHaveTheirOwnOrder) {
  Certify(1);
  SeeRobot(1, 3);
  plans_.RobotHasChanged();
  states_ = 0;
  const std::int64_t began = now_;
  now_ -= 1000;  // by a clock that is a little behind
  SeeRobot(77, 0);
  EXPECT_EQ(plans_.num_in_force(), 2u);
  SeeRobot(-1, -1);
  EXPECT_EQ(plans_.num_in_force(), 1u) << "its own plan has ended, that of the other one has not";
  now_ = began + 2 * 500'000 + kSteps * 150'000;
  SeeRobot(-1, -1);
  EXPECT_EQ(plans_.num_in_force(), 1u);
  now_ += 1;
  SeeRobot(-1, -1);
  EXPECT_EQ(plans_.num_in_force(), 0u);
}

// ---- Obstacles that are lost.

struct LostObstaclesTest : PlansInForceTest {
  static constexpr std::int64_t kLostUs = 1'000'000;

  LostObstaclesTest() { Lose(kLostUs / 1e3); }

  void Lose(double after_ms) {
    config_.gate.obstacles_lost_ms = after_ms;
    plans_.Follow(config_.gate);
  }
  // A wall is seen on the way of the plan, with a stamp that is 2 s old.
  void SeeStaleWall() {
    EXPECT_THAT(
        gate_.UpdateObstacles(
            Encode(Sighted({Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 1)}, now_ - 2'000'000, sequence_++)), now_),
        HasSubstr("stamped 2000 ms ago"));
  }
  void Judge() { JudgeBy(gate_); }
  void JudgeBy(Gate& gate) {
    plans_.SeeObstacles(gate.WhyObstaclesUnknown(now_), now_);
    plans_.Judge(gate, now_);
  }
};

TEST_F(LostObstaclesTest, WhatIsUnderWayIsWithdrawnWholeOnceTheyHaveBeenUnknownForSoLong) {
  const certified_plan_t executing = Certify(1), pending = Certify(2);
  SeeRobot(1, 3);
  Judge();
  SeeStaleWall();
  Judge();
  EXPECT_FALSE(Due());
  now_ += kLostUs - 1;
  SeeStaleWall();
  Judge();
  EXPECT_FALSE(Due()) << "a moment before";
  now_ += 1;
  Judge();
  for (const certified_plan_t& plan : {executing, pending}) {
    const withdrawal_t message = Due().value();
    EXPECT_FIELDS(message, (plan_id, plan.plan.plan_id), (cause, withdrawal_t::OBSTACLES_LOST), (valid_steps, 0),
                  (step, -1), (obstacle, -1));
    EXPECT_EQ(GetDigest(message.certificate_digest), GetDigest(plan.certificate_digest));
    EXPECT_EQ(GroundsOf(message), gate_.grounds());
    EXPECT_THAT(GetText(message.message),
                HasSubstr("the obstacles have been unknown for 1000 ms, so nothing stands, and "
                          "the stop is not certified: the last message was refused"));
  }
  EXPECT_FALSE(Due());
  EXPECT_EQ(plans_.withdrawals(), 2);
}

TEST_F(LostObstaclesTest, ASenderThatFallsSilentLosesThemAfterBothTimes) {
  Certify(1);
  SeeRobot(1, 0);
  const std::int64_t last = now_, timeout = 1'000'000;  // gate.obstacles_timeout_ms
  for (const std::int64_t us : {timeout, timeout + 1, timeout + kLostUs}) {
    now_ = last + us;
    Judge();
    EXPECT_FALSE(Due()) << us;
  }
  now_ = last + timeout + 1 + kLostUs;
  Judge();
  EXPECT_EQ(Due().value().cause, withdrawal_t::OBSTACLES_LOST);
}

TEST_F(LostObstaclesTest, ThatTheyAreKnownOnceInBetweenBeginsTheTimeAnew) {
  const certified_plan_t plan = Certify(1);
  SeeRobot(1, 0);
  const Obstacle beyond = Obstacle::HalfSpace(Eigen::Vector2d(1, 0), Reach(plan, kSteps) + 0.1);
  for (int i = 0; i < 5; ++i) {
    SeeStaleWall();
    Judge();
    now_ += kLostUs - 1;
    Judge();
    EXPECT_EQ(See({beyond}), "");
    Judge();
    EXPECT_FALSE(Due()) << i;
  }
}

TEST_F(LostObstaclesTest, WithNeverThePlanGoesOn) {
  Lose(kNeverLost);
  Certify(1);
  SeeRobot(1, 0);
  SeeStaleWall();
  Judge();
  now_ += 3'000'000;
  Judge();
  EXPECT_FALSE(Due());
}

TEST_F(LostObstaclesTest, APlanThatIsNotKnownIsWithdrawnToo) {
  Gate restarted(config_);
  JudgeBy(restarted);
  SeeRobot(77, 4);
  JudgeBy(restarted);
  now_ += kLostUs;
  JudgeBy(restarted);
  const withdrawal_t stranger = Due().value();
  EXPECT_FIELDS(stranger, (plan_id, 77), (cause, withdrawal_t::OBSTACLES_LOST));
  EXPECT_EQ(GetDigest(stranger.certificate_digest), Digest{});
  Answer(77, 0, static_cast<double>(stranger.sequence));
}

TEST_F(LostObstaclesTest, NothingStandsAgainWhenTheyReturn) {
  Certify(1);
  SeeRobot(1, 0);
  SeeStaleWall();
  Judge();
  now_ += kLostUs;
  Judge();
  const withdrawal_t lost = Due().value();
  Answer(1, 0, static_cast<double>(lost.sequence));
  EXPECT_EQ(See({}), "");
  Judge();
  now_ += PlanLedger::kRepeatUs;
  EXPECT_FALSE(Due());
  EXPECT_EQ(plans_.withdrawals(), 1);
  Certify(2);
  Judge();
  EXPECT_FALSE(Due()) << "a plan that is certified when they are known stands";
}

TEST_F(LostObstaclesTest, WhoStandsByForgetsSinceWhen) {
  SeeStaleWall();
  Judge();
  plans_.StandBy();
  now_ += kLostUs;
  SeeRobot(77, 4);
  Judge();
  EXPECT_FALSE(Due()) << "another has seen them meanwhile";
}

// To contradict, not to be added, is what ends a certificate.
TEST_F(PlansInForceTest, AnObservationThatContradictsNothingWithdrawsNothing) {
  const certified_plan_t plan = Certify(1);
  SeeWall(Reach(plan, kSteps) + 0.01);
  const Digest before = gate_.grounds().observations;
  EXPECT_EQ(gate_.Learn(Encode(AtRest(now_))), "");
  EXPECT_NE(gate_.grounds().observations, before);
  EXPECT_FALSE(gate_.certifier().violation());
  plans_.Judge(gate_, now_);
  EXPECT_FALSE(Due());
}

TEST_F(PlansInForceTest, AFalsifiedDeclarationWithdrawsEveryStep) {
  config_.gate.learns = true;
  Certify(1);
  SeeRobot(1, 2);
  EXPECT_EQ(gate_.Learn(Encode(AtRest(now_, 1))), "");
  ASSERT_TRUE(gate_.certifier().violation());
  plans_.Judge(gate_, now_);
  EXPECT_FIELDS(Due().value(), (cause, withdrawal_t::FALSIFIED), (valid_steps, 0));
}

TEST_F(PlansInForceTest, JudgesThePlanUnderATaskThatWasReadAgain) {
  const certified_plan_t plan = Certify(1);
  const withdrawal_t message = DueUnder(NarrowerFrom(plan, 8)).value();
  EXPECT_EQ(message.cause, withdrawal_t::DOMAIN_EXIT);
  EXPECT_EQ(message.step, 8) << "control 8 may begin outside the domain";
  EXPECT_EQ(message.valid_steps, 8);
}

// The task file is the same, its file of transitions is not.
TEST_F(PlansInForceTest, JudgesThePlanAgainUnderOtherTransitionsOfTheTask) {
  const certified_plan_t plan = Certify(1);
  SeeWall(Reach(plan, kSteps) + 0.01);
  EXPECT_FALSE(Due());
  Problem& problem = Own(config_.problem);
  problem.transitions.x_next.col(2).array() += 0.01;  // everywhere the same residual
  config_.grounds = GroundsOf(config_.grounds.config, problem, config_.obstacles);
  const withdrawal_t message = DueUnder(config_).value();
  EXPECT_EQ(message.cause, withdrawal_t::OBSTACLE);
  EXPECT_LT(message.valid_steps, kSteps);
}

TEST_F(PlansInForceTest, AnObstacleBeforeTheStepThatLeavesTheDomainCounts) {
  const certified_plan_t plan = Certify(1);
  Config narrower = NarrowerFrom(plan, 8);
  narrower.obstacles.push_back(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), Reach(plan, 4) - 1e-9));
  EXPECT_FIELDS(DueUnder(narrower).value(), (cause, withdrawal_t::OBSTACLE), (valid_steps, 3));
}

TEST_F(PlansInForceTest, AnEndThatIsNotAtRestKeepsItsControls) {
  Certify(1);
  const Config resting = Another([](Config&, Problem& problem) { problem.rest = {{2, 0.1}}; });  // it ends at 1 m/s
  EXPECT_FIELDS(DueUnder(resting).value(), (cause, withdrawal_t::NO_STOP), (valid_steps, kSteps));
}

// It is exceeded first where the robot has come that far: the control that leads there does not stand.
TEST_F(PlansInForceTest, ALimitOfANewTaskLeavesTheControlsBeforeIt) {
  const certified_plan_t plan = Certify(1);
  const auto judge = [&](double most) {
    return DueUnder(Another([&](Config&, Problem& problem) {
      problem.limits = {{.name = "it", .that = {"px", 1, 1}, .at_most = most}};
      problem.between = Between{Eigen::Vector2d(8, 8), 0, 0, 0.15};  // it is exceeded at the sample, not on the way
    }));
  };
  EXPECT_FALSE(judge(Reach(plan, kSteps) + 1e-9));
  const withdrawal_t message = judge(Reach(plan, 6) - 1e-9).value();
  EXPECT_FIELDS(message, (cause, withdrawal_t::LIMIT), (step, 6), (obstacle, -1), (valid_steps, 5),
                (threshold, Reach(plan, 6) - 1e-9));
}

TEST_F(PlansInForceTest, AnUnknownPlanIsWithdrawnOnceTheObstaclesAreKnownAndAfterEachChange) {
  Gate restarted(config_);
  const auto judge = [&] { plans_.Judge(restarted, now_); };
  judge();
  SeeRobot(77, 4);
  judge();
  EXPECT_FALSE(Due()) << "the obstacles are not known yet";
  ASSERT_EQ(restarted.UpdateObstacles(Encode(Sighted({}, now_, 1)), now_), "");
  judge();
  const withdrawal_t withdrawal = Due().value();
  EXPECT_FIELDS(withdrawal, (plan_id, 77), (cause, withdrawal_t::UNKNOWN_PLAN));
  EXPECT_EQ(GetDigest(withdrawal.certificate_digest), Digest{});
  EXPECT_EQ(GroundsOf(withdrawal), restarted.grounds());
  EXPECT_EQ(restarted.Learn(Encode(AtRest(now_))), "");
  Answer(77, 20, 0);  // it stands: the guard found equal grounds
  now_ += PlanLedger::kRepeatUs;
  EXPECT_FALSE(Due());
  const obstacles_t seen = Sighted({Obstacle::Circle(Eigen::Vector2d(9, 9), 1)}, now_, 2);
  ASSERT_EQ(restarted.UpdateObstacles(Encode(seen), now_), "");
  judge();
  const withdrawal_t changed = Due().value();
  EXPECT_EQ(changed.plan_id, 77);
  EXPECT_EQ(GetDigest(changed.observations_digest), restarted.transitions()) << "without what it has learned";
  EXPECT_EQ(restarted.Learn(Encode(AtRest(now_, 1))), "");
  ASSERT_TRUE(restarted.certifier().violation());
  judge();
  EXPECT_NE(GetDigest(Due()->observations_digest), restarted.transitions()) << "no guard has these";
}

// As after a restart, by a latch file or the heartbeats of a predecessor: no observation of this gate contradicts.
TEST_F(PlansInForceTest, NoUnknownPlanStandsUnderADeclarationThatIsKnownToBeFalse) {
  SeeRobot(77, 4);
  plans_.Judge(gate_, now_, false);
  EXPECT_EQ(GetDigest(Due().value().observations_digest), gate_.transitions());
  plans_.Judge(gate_, now_, true);
  EXPECT_EQ(GetDigest(Due().value().observations_digest), Digest{}) << "no certificate names these";
}

}  // namespace forereach::plans_in_force_test
