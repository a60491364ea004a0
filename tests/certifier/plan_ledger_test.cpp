// The ledger of certified plans: which of them may be executing, whether the robot is where one leads, and what is
// withdrawn.
#include "certifier/gate/plan_ledger.h"

#include <fmt/format.h>

#include "tests/test.h"

#include "tests/certifier/small_task.h"

namespace forereach::plan_ledger_test {

constexpr std::int64_t kStep = 100'000, kLifetime = 2'000'000, kAge = 500'000, kSteady = 5'000'000;
constexpr std::int64_t kWall = 1'700'000'000'000'000;

// Certified at kWall, with the slices [t, t + 1] in both coordinates.
certified_plan_t Plan(std::int64_t plan_id, int steps = 3) {
  certified_plan_t certified{.utime = kWall, .expires_utime = kWall + kLifetime};
  certified.plan.plan_id = plan_id;
  certified.plan.num_states = 2;
  certified.plan.num_steps = static_cast<std::int16_t>(steps);
  certified.plan.step_us = kStep;
  for (int t = 0; t <= steps; ++t)
    for (int k = 0; k < 2; ++k) certified.slice_lower[t][k] = t, certified.slice_upper[t][k] = t + 1;
  return certified;
}

// ---- Which plans may be executing, at the boundaries of time and step.

struct StrangersTest : testing::Test {
  static GateOptions Gate() {
    return {.max_age_ms = kAge / 1e3, .certificate_lifetime_ms = kLifetime / 1e3, .longest_step_ms = kStep / 1e3};
  }
  static std::int64_t Life(int steps) { return kLifetime + 2 * kAge + steps * kStep; }

  static robot_state_t Executing(std::int64_t plan_id, int step, std::int64_t utime = kWall) {
    return {.utime = utime,
            .executing_plan_id = plan_id,
            .executing_step = static_cast<std::int16_t>(step),
            .mode = robot_state_t::EXECUTING};
  }
  std::string Judge(const robot_state_t& state, std::int64_t steady) {
    const auto stranger = issued_.FindStranger(state, steady);
    return stranger ? stranger->why : "";
  }

  static constexpr std::int64_t kLater = kSteady + kLifetime + 2 * kAge + 128 * kStep + 1;  // nothing else is tolerated
  PlanLedger issued_{Gate(), kSteady};
};

TEST_F(StrangersTest, ToleratesUnknownPlansUntilThoseOfAnEarlierCertifierHaveEnded) {
  EXPECT_EQ(Judge(Executing(1, 0), kLater - 1), "");
  EXPECT_THAT(Judge(Executing(1, 0), kLater), HasSubstr("plan 1, which was not certified"));
  EXPECT_THAT(Judge(Executing(-1, -1), kLater), HasSubstr("plan -1, which was not certified"));
  robot_state_t standing = Executing(1, 0);
  for (const std::int16_t mode : {robot_state_t::STANDING, robot_state_t::FINISHED}) {
    standing.mode = mode;
    EXPECT_EQ(Judge(standing, kLater), "");
  }
}

TEST_F(StrangersTest, AllowsAKnownPlanUntilItsEndAndNoLonger) {
  issued_.Add(Plan(1, 10), kLater);
  EXPECT_EQ(Judge(Executing(1, 9), kLater + Life(10)), "");
  EXPECT_THAT(Judge(Executing(1, 9), kLater + Life(10) + 1), HasSubstr("should have ended"));
  EXPECT_THAT(Judge(Executing(2, 0), kLater), HasSubstr("plan 2, which was not certified"));
}

TEST_F(StrangersTest, RefusesAStepThatThePlanDoesNotHave) {
  issued_.Add(Plan(1, 10), kLater);
  EXPECT_EQ(Judge(Executing(1, 0), kLater), "");
  EXPECT_EQ(Judge(Executing(1, 9), kLater), "");
  EXPECT_THAT(Judge(Executing(1, 10), kLater), HasSubstr("plan 1, step 10 of 10"));
  EXPECT_THAT(Judge(Executing(1, -1), kLater), HasSubstr("plan 1, step -1 of 10"));
  issued_.Add(Plan(2, 10), kSteady);
  EXPECT_THAT(Judge(Executing(2, 10), kSteady), HasSubstr("step 10 of 10")) << "also while unknown plans are tolerated";
  issued_.Add(Plan(1, 20), kLater);
  EXPECT_EQ(Judge(Executing(1, 10), kLater), "") << "another source has used its number";
}

TEST_F(StrangersTest, RefusesAPlanThatBeganAfterItExpired) {
  const std::int64_t latest = kWall + kLifetime + kAge;
  for (const int step : {0, 9}) {
    PlanLedger issued(Gate(), kSteady);
    issued.Add(Plan(1, 10), kLater);
    const auto late = issued.FindStranger(Executing(1, step, latest + 1 + step * kStep), kLater).value();
    EXPECT_THAT(late.why, HasSubstr("plan 1, which began 500 ms after its certificate had expired"));
    EXPECT_FALSE(issued.FindStranger(Executing(1, step, latest + step * kStep), kLater));
    EXPECT_FALSE(issued.FindStranger(Executing(1, step, latest + 3'600'000'000), kLater))
        << "the clock was set meanwhile";
  }
}

TEST_F(StrangersTest, SurvivesNumbersOfAnySize) {
  certified_plan_t odd = Plan(1, 10);
  odd.plan.step_us = INT64_MIN;
  issued_.Add(odd, kLater);
  static_cast<void>(Judge(Executing(1, 9, INT64_MAX), kLater));
  static_cast<void>(Judge(Executing(1, 9, INT64_MIN), kLater));
}

// What is pushed out by a flood of certificates may still be executing.
TEST_F(StrangersTest, ToleratesAPlanThatAFloodOfCertificatesPushedOut) {
  issued_.Add(Plan(1, 10), kLater);
  for (std::size_t i = 0; i < PlanLedger::kPlans - 1; ++i) issued_.Add(Plan(1000, 20), kLater + 1);
  EXPECT_THAT(Judge(Executing(2, 0), kLater + 1), HasSubstr("not certified"));
  EXPECT_THAT(Judge(Executing(1, 10), kLater + 1), HasSubstr("step 10 of 10")) << "remembered";
  EXPECT_TRUE(issued_.IsFull());
  robot_state_t finished{};
  finished.mode = robot_state_t::FINISHED;
  issued_.SeeRobot(finished, kLater + 1);
  EXPECT_FALSE(issued_.IsFull()) << "none of them will be executed any more, if the robot has a guard";
  EXPECT_THAT(Judge(Executing(1, 10), kLater + 1), HasSubstr("step 10 of 10")) << "remembered still";
  issued_.Add(Plan(1000, 20), kLater + 1);
  EXPECT_EQ(Judge(Executing(1, 10), kLater + Life(10)), "") << "forgotten, so tolerated";
  EXPECT_EQ(Judge(Executing(2, 0), kLater + Life(10)), "") << "and nobody can tell it from any other";
  EXPECT_THAT(Judge(Executing(2, 0), kLater + Life(10) + 1), HasSubstr("not certified"));
}

TEST_F(StrangersTest, AFloodOfCertificatesDoesNotPushOutThePlanThatIsExecuted) {
  issued_.Add(Plan(1000, 10), kLater);
  for (std::size_t i = 0; i < PlanLedger::kPlans - 1; ++i) issued_.Add(Plan(1, 10), kLater);
  issued_.SeeRobot(Executing(1000, 0), kLater);
  ASSERT_EQ(issued_.num_in_force(), 1u);
  for (int i = 0; i < 3; ++i) issued_.Add(Plan(1001, 10), kLater);
  EXPECT_EQ(issued_.num_in_force(), 4u);
  EXPECT_THAT(Judge(Executing(1000, 10), kLater + 1), HasSubstr("step 10 of 10")) << "remembered";
}

TEST_F(StrangersTest, AnotherCertifierBeginsTheToleranceAnewAReloadDoesNot) {
  GateOptions longer = Gate();
  longer.certificate_lifetime_ms += 1;
  issued_.Follow(longer);
  EXPECT_NE(Judge(Executing(1, 0), kLater), "");
  issued_.TolerateIssuedUntil(kLater);
  EXPECT_EQ(Judge(Executing(1, 0), kLater + Life(128) + 1000), "");
  EXPECT_NE(Judge(Executing(1, 0), kLater + Life(128) + 1001), "");
  issued_.TolerateIssuedUntil(kLater - 1'000'000);
  EXPECT_EQ(Judge(Executing(1, 0), kLater + Life(128) + 1000), "") << "never for less than before";
}

// ---- A measured state against the slice of the step it is at.

robot_state_t At(std::int64_t sequence, std::int64_t plan_id, int step, double x, double y) {
  robot_state_t state{.sequence = sequence,
                      .executing_plan_id = plan_id,
                      .executing_step = static_cast<std::int16_t>(step),
                      .mode = plan_id < 0 ? robot_state_t::STANDING : robot_state_t::EXECUTING,
                      .num_states = 2};
  state.state[0] = x;
  state.state[1] = y;
  return state;
}

transition_t Step(std::int64_t utime, double x, double y) {
  transition_t transition{.utime = utime, .num_states = 2};
  transition.next_state[0] = x;
  transition.next_state[1] = y;
  return transition;
}

struct DeparturesTest : testing::Test {
  PlanLedger ledger_{{}, 0};
};

TEST_F(DeparturesTest, TheSliceIsClosed) {
  ledger_.Add(Plan(7), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 1, 1, 2)));
  const auto above = ledger_.FindDeparture(At(10, 7, 1, 1, std::nextafter(2.0, 3.0))).value();
  EXPECT_FIELDS(above, (plan_id, 7), (step, 1), (coordinate, 1), (upper, 2));
  EXPECT_EQ(ledger_.FindDeparture(At(20, 7, 1, std::nextafter(1.0, 0.0), 1))->coordinate, 0);
  EXPECT_TRUE(ledger_.FindDeparture(At(30, 7, 1, std::numeric_limits<double>::quiet_NaN(), 1)));
}

TEST_F(DeparturesTest, TheEndOfTheOldPlanIsJudgedWhereAnotherTakesOver) {
  ledger_.Add(Plan(7), 0);
  certified_plan_t next = Plan(8);
  next.slice_upper[0][0] = next.slice_upper[0][1] = 9;
  ledger_.Add(next, 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 0, 0.5, 0.5)));
  const auto departure = ledger_.FindDeparture(At(1, 8, 0, 0.5, 1.5));
  ASSERT_TRUE(departure) << "inside slice 0 of plan 8, not inside slice 1 of plan 7";
  EXPECT_FIELDS(*departure, (plan_id, 7), (step, 1));
  EXPECT_FALSE(ledger_.FindDeparture(At(5, 8, 0, 0.5, 1.5))) << "with messages missing between, it cannot tell";
}

// By a hold the robot left the plan before the boundary, so it need not be where the plan leads.
TEST_F(DeparturesTest, APlanThatTheRobotSaysItHasStoppedIsNotJudgedWhereAnotherStarts) {
  certified_plan_t next = Plan(8);
  next.slice_upper[0][0] = next.slice_upper[0][1] = 9;
  struct {
    std::int16_t kind;
    std::int64_t plan_id;
    int step;
    SenderId sender;
    bool judged;
  } const cases[] = {{execution_event_t::ERROR_STOP, 7, 0, {}, false},
                     {execution_event_t::EMERGENCY_STOP, 7, 0, {}, false},
                     {execution_event_t::HALTED, 7, 0, {}, false},
                     {execution_event_t::OFF_SCHEDULE, 7, 1, {}, false},
                     {execution_event_t::OFF_SCHEDULE, 7, 2, {}, true},
                     {execution_event_t::STEP_OUTSIDE, 7, 1, {}, true},
                     {execution_event_t::STEP_INSIDE, 7, 1, {}, true},
                     {execution_event_t::ERROR_STOP, 6, 0, {}, true},
                     {execution_event_t::ERROR_STOP, 7, 0, SenderId(1), true}};
  for (const auto& [kind, plan_id, step, sender, judged] : cases) {
    PlanLedger ledger({}, 0);
    ledger.Add(Plan(7), 0);
    ledger.Add(next, 0);
    EXPECT_FALSE(ledger.FindDeparture(At(0, 7, 0, 0.5, 0.5)));
    execution_event_t event{.plan_id = plan_id, .kind = kind, .step = static_cast<std::int16_t>(step)};
    ledger.SeeStop(event, sender);
    EXPECT_EQ(ledger.FindDeparture(At(1, 8, 0, 0.5, 1.5)).has_value(), judged) << kind << " " << plan_id << " " << step;
    EXPECT_TRUE(ledger.FindDeparture(At(2, 8, 1, 0.5, 9))) << "the next plan is judged as any";
  }
}

// What a robot says of a stop hides neither its own slice nor the end of a step that it reports.
TEST_F(DeparturesTest, AStopHidesNoDepartureThatIsReported) {
  ledger_.Add(Plan(7), 0);
  ledger_.Add(Plan(8), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 0, 0.5, 0.5)));
  execution_event_t event{.plan_id = 7, .kind = execution_event_t::ERROR_STOP};
  ledger_.SeeStop(event, {});
  EXPECT_EQ(ledger_.FindDeparture(Step(0, 100, 100))->plan_id, 7) << "the whole step";
  EXPECT_EQ(ledger_.FindDeparture(At(1, 8, 0, 0.5, 1.5))->plan_id, 8);
  EXPECT_EQ(ledger_.FindDeparture(At(20, 7, 1, 0.5, 1.5))->plan_id, 7) << "it goes on with it";
}

TEST_F(DeparturesTest, StandingAndUnknownPlansAreNotJudged) {
  ledger_.Add(Plan(7), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 2, 2.5, 2.5)));
  EXPECT_FALSE(ledger_.FindDeparture(At(1, -1, -1, 100, 100))) << "standing is a hold mode of the robot";
  EXPECT_FALSE(ledger_.FindDeparture(At(2, 99, 0, 100, 100)));
  EXPECT_FALSE(ledger_.FindDeparture(At(3, 7, 4, 100, 100))) << "past the horizon";
  EXPECT_FALSE(ledger_.FindDeparture(At(5, 7, -1, 100, 100)));
}

TEST_F(DeparturesTest, TheSmallestSequenceDoesNotFollowTheLargest) {
  ledger_.Add(Plan(7), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(std::numeric_limits<std::int64_t>::max(), 7, 0, 0.5, 0.5)));
  EXPECT_FALSE(ledger_.FindDeparture(At(std::numeric_limits<std::int64_t>::min(), 99, 0, 100, 100)));
}

TEST_F(DeparturesTest, AnAngleMayDifferByWholeTurns) {
  constexpr double kTurn = 2 * std::numbers::pi;
  ledger_.Add(Plan(7), 0, Angles(0b10));
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 1, 1.5, 1.5)));
  EXPECT_FALSE(ledger_.FindDeparture(At(10, 7, 1, 1.5, 1.5 + kTurn)));
  EXPECT_FALSE(ledger_.FindDeparture(At(20, 7, 1, 1.5, 1.5 - 3 * kTurn)));
  EXPECT_EQ(ledger_.FindDeparture(At(30, 7, 1, 1.5, 2.5 - kTurn))->coordinate, 1);
  EXPECT_EQ(ledger_.FindDeparture(At(40, 7, 1, 1.5 + kTurn, 1.5))->coordinate, 0) << "that state is no angle";
  EXPECT_TRUE(ledger_.FindDeparture(At(50, 7, 1, 1.5, 1 + kTurn))) << "at the end of the slice it cannot be told";
  ledger_.Add(Plan(8), 0);
  EXPECT_TRUE(ledger_.FindDeparture(At(60, 8, 1, 1.5, 1.5 + kTurn))) << "a plan of a task without angles";
  ledger_.Add(Plan(8), 0, Angles(0b10));
}

TEST_F(DeparturesTest, ASliceIsLeftByMoreThanTheStateErrorOnly) {
  certified_plan_t plan = Plan(7);
  plan.state_error[1] = 0.25;
  ledger_.Add(plan, 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 1, 1, 2.25)));
  EXPECT_FALSE(ledger_.FindDeparture(At(10, 7, 1, 2, 0.75)));
  const auto above = ledger_.FindDeparture(At(20, 7, 1, 1, std::nextafter(2.25, 3))).value();
  EXPECT_FIELDS(above, (coordinate, 1), (value, std::nextafter(2.25, 3)), (error, 0.25), (upper, 2));
  EXPECT_TRUE(ledger_.FindDeparture(At(30, 7, 1, 1, std::nextafter(0.75, 0))));
  EXPECT_EQ(ledger_.FindDeparture(At(40, 7, 1, std::nextafter(2.0, 3.0), 1))->coordinate, 0) << "that one is exact";
}

TEST_F(DeparturesTest, AStateMayBringItsOwnError) {
  certified_plan_t plan = Plan(7);
  plan.state_error[1] = 0.25;
  ledger_.Add(plan, 0);
  const auto at = [](std::int64_t sequence, double y, double error) {
    robot_state_t state = At(sequence, 7, 1, 1, y);
    state.num_state_errors = 2;
    state.state_error[1] = error;
    return state;
  };
  EXPECT_FALSE(ledger_.FindDeparture(at(0, 2.5, 0.5)));
  EXPECT_EQ(ledger_.FindDeparture(at(10, 2.5, 0.375))->error, 0.375);
  EXPECT_TRUE(ledger_.FindDeparture(at(20, 2.125, 0))) << "measured better than declared";
  EXPECT_FALSE(ledger_.FindDeparture(At(30, 7, 1, 1, 2.125)));
}

TEST_F(DeparturesTest, TheEndOfAStepMayBeOffByTheDeclaredError) {
  certified_plan_t plan = Plan(7);
  plan.state_error[0] = 0.25;
  ledger_.Add(plan, 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 0, 0.5, 0.5)));
  EXPECT_FALSE(ledger_.FindDeparture(Step(0, 2.25, 2)));
  EXPECT_TRUE(ledger_.FindDeparture(Step(0, std::nextafter(2.25, 3), 2)));
}

TEST_F(DeparturesTest, TheEndOfAStepIsJudgedThoughTheRobotStandsThere) {
  ledger_.Add(Plan(7), 0);
  const auto after = [&](std::int64_t sequence, int step, const transition_t& transition) {
    robot_state_t state = At(10 * sequence, 7, step, step + 0.5, step + 0.5);  // each is judged by itself
    state.utime = 100 * sequence;
    EXPECT_FALSE(ledger_.FindDeparture(state));
    return ledger_.FindDeparture(transition);
  };
  EXPECT_FALSE(after(1, 0, Step(100, 1, 2)));
  EXPECT_FIELDS(after(2, 0, Step(200, 1, std::nextafter(2.0, 3.0))).value(), (step, 1), (coordinate, 1));
  EXPECT_FALSE(after(3, 0, Step(299, 100, 100))) << "another step's";
  EXPECT_EQ(after(4, 2, Step(400, 100, 100))->step, 3) << "the last slice too";
  EXPECT_FALSE(after(5, 3, Step(500, 100, 100))) << "past the horizon";
  transition_t odd = Step(600, 100, 100);
  odd.num_states = 17;
  EXPECT_FALSE(after(6, 0, odd));
  robot_state_t standing = At(7, -1, -1, 0, 0);
  standing.utime = 700;
  EXPECT_FALSE(ledger_.FindDeparture(standing));
  EXPECT_FALSE(ledger_.FindDeparture(Step(700, 100, 100)));
}

TEST_F(DeparturesTest, TheEndOfAStepIsJudgedThoughTheNextStateOvertookIt) {
  ledger_.Add(Plan(7), 0);
  const auto hear = [&](std::int64_t sequence, std::int64_t plan_id, std::int64_t utime) {
    robot_state_t state = At(sequence, plan_id, plan_id < 0 ? -1 : 0, 0.5, 0.5);
    state.utime = utime;
    EXPECT_FALSE(ledger_.FindDeparture(state));
  };
  hear(0, 7, 100);
  hear(1, -1, 200);
  EXPECT_TRUE(ledger_.FindDeparture(Step(100, 100, 100)));
  EXPECT_FALSE(ledger_.FindDeparture(Step(200, 100, 100))) << "it stood";
  for (int i = 2; i < 34; ++i) hear(i, -1, 100 + 100 * i);
  hear(0, 7, 100);
  EXPECT_FALSE(ledger_.FindDeparture(Step(100, 100, 100)))
      << "a state said again is not news, so the step is too long ago";
  hear(0, 7, 4000);
  EXPECT_TRUE(ledger_.FindDeparture(Step(4000, 100, 100))) << "a robot that began anew counts anew";
  hear(16, 7, 5000);
  hear(1, 7, 30);
  EXPECT_FALSE(ledger_.FindDeparture(Step(30, 100, 100))) << "late";
  hear(0, 7, 30);
  EXPECT_TRUE(ledger_.FindDeparture(Step(30, 100, 100)))
      << "another message 0: it has begun anew, though its clock was set back";
}

TEST_F(DeparturesTest, TheEndOfAStepIsJudgedThoughAFasterRobotIsHeardInBetween) {
  for (const int states_between : {3, 31, 32}) {
    PlanLedger ledger({}, 0);
    ledger.Add(Plan(7), 0);
    robot_state_t begin = At(0, 7, 0, 0.5, 0.5);
    begin.utime = 100;
    EXPECT_FALSE(ledger.FindDeparture(begin));
    for (int i = 0; i < states_between; ++i) {
      robot_state_t other = At(100 + i, -1, -1, 0, 0);
      other.utime = 101 + i;
      EXPECT_FALSE(ledger.FindDeparture(other));
    }
    EXPECT_EQ(ledger.FindDeparture(Step(100, 100, 100)).has_value(), states_between < 32);
  }
}

// Two robots under one name begin steps of different plans at one time.
TEST_F(DeparturesTest, StatesAndTransitionsOfTwoSendersAreNotMixed) {
  ledger_.Add(Plan(7), 0);
  ledger_.Add(Plan(8), 0);
  robot_state_t one = At(4, 7, 0, 0.5, 0.5), other = At(5, 8, 2, 2.5, 2.5);
  one.utime = other.utime = 100;
  EXPECT_FALSE(ledger_.FindDeparture(one, 1));
  EXPECT_FALSE(ledger_.FindDeparture(other, 2)) << "it does not follow the other one's step";
  EXPECT_FALSE(ledger_.FindDeparture(Step(100, 1.5, 1.5), 1));
  EXPECT_FALSE(ledger_.FindDeparture(Step(100, 3.5, 3.5), 2));
  EXPECT_EQ(ledger_.FindDeparture(Step(100, 3.5, 3.5), 1)->plan_id, 7);
  EXPECT_EQ(ledger_.FindDeparture(Step(100, 1.5, 1.5), 2)->plan_id, 8);
  EXPECT_FALSE(ledger_.FindDeparture(Step(100, 100, 100), 3));
}

TEST_F(DeparturesTest, ANewCertificateOfTheSameIdCountsUnlessTheOldOneIsExecuted) {
  ledger_.Add(Plan(7), 0);
  certified_plan_t again = Plan(7);
  again.slice_upper[1][0] = 5;
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 0, 0.5, 0.5)));
  ledger_.Add(again, 0);
  EXPECT_TRUE(ledger_.FindDeparture(At(10, 7, 1, 4, 1))) << "the guard takes no plan_id twice";
  EXPECT_FALSE(ledger_.FindDeparture(At(20, -1, -1, 0, 0)));
  ledger_.Add(again, 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(30, 7, 1, 4, 1)));
}

TEST_F(DeparturesTest, ThePlanThatIsExecutedIsNotForgotten) {
  const auto count = static_cast<std::int64_t>(PlanLedger::kSlices);
  for (std::int64_t id = 0; id < count; ++id) ledger_.Add(Plan(id), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 0, 0, 0.5, 0.5)));
  for (std::int64_t id = count; id < 3 * count; ++id) ledger_.Add(Plan(id), 0);
  EXPECT_TRUE(ledger_.FindDeparture(At(10, 0, 1, 100, 100)));
  EXPECT_TRUE(ledger_.FindDeparture(At(20, 3 * count - 1, 0, 100, 100)));
  EXPECT_FALSE(ledger_.FindDeparture(At(30, 2 * count, 0, 100, 100))) << "the others are, in their order";
}

TEST_F(DeparturesTest, TheLastPlansAreRemembered) {
  const auto count = static_cast<std::int64_t>(PlanLedger::kSlices);
  for (std::int64_t id = 0; id <= count; ++id) ledger_.Add(Plan(id), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 0, 0, 100, 100))) << "the first is forgotten";
  EXPECT_TRUE(ledger_.FindDeparture(At(10, 1, 0, 100, 100)));
  EXPECT_TRUE(ledger_.FindDeparture(At(20, count, 0, 100, 100)));
}

// ---- Plans are judged again, how many controls stand, and when withdrawals are sent.

constexpr int kSteps = 10;  // of Candidate

struct WithdrawalsTest : testing::Test {
  WithdrawalsTest() { SeeAndJudge({}); }

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

TEST_F(WithdrawalsTest, AWallLeavesTheControlsBeforeTheFirstSliceThatMayTouchIt) {
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
TEST_F(WithdrawalsTest, WithdrawsFromTheStepWhoseMotionMayTouchBetweenSamples) {
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
TEST_F(WithdrawalsTest, WithdrawsEveryStepUnderATaskOfAShorterPeriod) {
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
TEST_F(WithdrawalsTest, APlanStandsUnderANewTaskOnlyIfItsGuardUpholdsWhatThatRestsOn) {
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

TEST_F(WithdrawalsTest, AWithdrawalNamesThePlanTheWitnessAndWhatItRestsOn) {
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

TEST_F(WithdrawalsTest, DoesNotJudgeStepsThatArePast) {
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

TEST_F(WithdrawalsTest, RepeatsAWithdrawalUntilItIsAnswered) {
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
TEST_F(WithdrawalsTest, PlansOfTwoSourcesWithOneIdAreAnsweredEachForItself) {
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

TEST_F(WithdrawalsTest, NeverRestoresStepsAndWithdrawsAgainWhenFewerStand) {
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

TEST_F(WithdrawalsTest, WithdrawsNothingWhileThePlanStaysValid) {
  const certified_plan_t plan = Certify(1);
  SeeAndJudge({});
  EXPECT_FALSE(Due());
  SeeWall(Reach(plan, kSteps) + 0.5);
  EXPECT_FALSE(Due()) << "a plan that stays valid gets no message";
}

TEST_F(WithdrawalsTest, APlanThatCannotBeExecutedAnyMoreIsForgotten) {
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

TEST_F(WithdrawalsTest, ALateStateChangesNothing) {
  Certify(1);
  states_ = 5;
  SeeRobot(1, 4);
  states_ = 3;
  SeeRobot(-1, -1);
  EXPECT_EQ(plans_.num_in_force(), 1u);
}

TEST_F(WithdrawalsTest, AWithdrawalIsNotSentAfterThePlansEnd) {
  Certify(1);
  SeeWall(1);
  EXPECT_TRUE(Due());
  now_ += 60'000'000;
  EXPECT_FALSE(Due());
}

TEST_F(WithdrawalsTest, OfManyPendingPlansTheNewestAreJudgedAndTheOthersWithdrawnWhole) {
  const int many = static_cast<int>(PlanLedger::kJudged) + 1;
  for (int id = 1; id <= many; ++id) Certify(id);
  SeeWall(15);  // none of them comes near
  EXPECT_FIELDS(Due().value(), (plan_id, 1), (cause, withdrawal_t::NOT_JUDGED), (valid_steps, 0));
  EXPECT_FALSE(Due());
}

TEST_F(WithdrawalsTest, TheExecutingPlanIsJudgedHoweverManyArePending) {
  Certify(1);
  SeeRobot(1, 0);
  for (int id = 2; id <= static_cast<int>(PlanLedger::kJudged) + 1; ++id) Certify(id);
  SeeWall(15);
  EXPECT_FALSE(Due());
}

// ---- Two robots under one name.

TEST_F(WithdrawalsTest, APlanThatTwoMayExecuteIsJudgedFromTheEarlierStepAndLeavesWithItsTime) {
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

TEST_F(WithdrawalsTest, OneOfTwoEndsNothing) {
  Certify(1);
  Certify(2);
  SeeRobot(1, 3);
  plans_.SeeOneOfTwo(State(-1, -1), now_);
  plans_.SeeOneOfTwo(State(2, 0), now_);
  EXPECT_EQ(plans_.num_in_force(), 2u);
}

TEST_F(WithdrawalsTest, ThePlanOfTheRobotBeforeLeavesWithItsTimeAndAnothersStatesHaveTheirOwnOrder) {
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

struct LostObstaclesTest : WithdrawalsTest {
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
TEST_F(WithdrawalsTest, AnObservationThatContradictsNothingWithdrawsNothing) {
  const certified_plan_t plan = Certify(1);
  SeeWall(Reach(plan, kSteps) + 0.01);
  const Digest before = gate_.grounds().observations;
  EXPECT_EQ(gate_.Learn(Encode(AtRest(now_))), "");
  EXPECT_NE(gate_.grounds().observations, before);
  EXPECT_FALSE(gate_.certifier().violation());
  plans_.Judge(gate_, now_);
  EXPECT_FALSE(Due());
}

TEST_F(WithdrawalsTest, AFalsifiedDeclarationWithdrawsEveryStep) {
  config_.gate.learns = true;
  Certify(1);
  SeeRobot(1, 2);
  EXPECT_EQ(gate_.Learn(Encode(AtRest(now_, 1))), "");
  ASSERT_TRUE(gate_.certifier().violation());
  plans_.Judge(gate_, now_);
  EXPECT_FIELDS(Due().value(), (cause, withdrawal_t::FALSIFIED), (valid_steps, 0));
}

TEST_F(WithdrawalsTest, JudgesThePlanUnderATaskThatWasReadAgain) {
  const certified_plan_t plan = Certify(1);
  const withdrawal_t message = DueUnder(NarrowerFrom(plan, 8)).value();
  EXPECT_EQ(message.cause, withdrawal_t::DOMAIN_EXIT);
  EXPECT_EQ(message.step, 8) << "control 8 may begin outside the domain";
  EXPECT_EQ(message.valid_steps, 8);
}

// The task file is the same, its file of transitions is not.
TEST_F(WithdrawalsTest, JudgesThePlanAgainUnderOtherTransitionsOfTheTask) {
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

TEST_F(WithdrawalsTest, AnObstacleBeforeTheStepThatLeavesTheDomainCounts) {
  const certified_plan_t plan = Certify(1);
  Config narrower = NarrowerFrom(plan, 8);
  narrower.obstacles.push_back(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), Reach(plan, 4) - 1e-9));
  EXPECT_FIELDS(DueUnder(narrower).value(), (cause, withdrawal_t::OBSTACLE), (valid_steps, 3));
}

TEST_F(WithdrawalsTest, AnEndThatIsNotAtRestKeepsItsControls) {
  Certify(1);
  const Config resting = Another([](Config&, Problem& problem) { problem.rest = {{2, 0.1}}; });  // it ends at 1 m/s
  EXPECT_FIELDS(DueUnder(resting).value(), (cause, withdrawal_t::NO_STOP), (valid_steps, kSteps));
}

// It is exceeded first where the robot has come that far: the control that leads there does not stand.
TEST_F(WithdrawalsTest, ALimitOfANewTaskLeavesTheControlsBeforeIt) {
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

TEST_F(WithdrawalsTest, AnUnknownPlanIsWithdrawnOnceTheObstaclesAreKnownAndAfterEachChange) {
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
TEST_F(WithdrawalsTest, NoUnknownPlanStandsUnderADeclarationThatIsKnownToBeFalse) {
  SeeRobot(77, 4);
  plans_.Judge(gate_, now_, false);
  EXPECT_EQ(GetDigest(Due().value().observations_digest), gate_.transitions());
  plans_.Judge(gate_, now_, true);
  EXPECT_EQ(GetDigest(Due().value().observations_digest), Digest{}) << "no certificate names these";
}

}  // namespace forereach::plan_ledger_test
