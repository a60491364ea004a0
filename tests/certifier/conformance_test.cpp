// The ledger of certified plans: a measured state against the slice of the step it is at.
#include "certifier/gate/plan_ledger.h"

#include "tests/test.h"

namespace forereach::conformance_test {

// Slices [t, t + 1] in both coordinates, T = 3.
certified_plan_t Plan(std::int64_t plan_id) {
  certified_plan_t plan{};
  plan.plan.plan_id = plan_id;
  plan.plan.num_states = 2;
  plan.plan.num_steps = 3;
  for (int t = 0; t <= 3; ++t)
    for (int k = 0; k < 2; ++k) plan.slice_lower[t][k] = t, plan.slice_upper[t][k] = t + 1;
  return plan;
}

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

struct ConformanceTest : testing::Test {
  PlanLedger ledger_{{}, 0};
};

TEST_F(ConformanceTest, TheSliceIsClosed) {
  ledger_.Add(Plan(7), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 1, 1, 2)));
  const auto above = ledger_.FindDeparture(At(10, 7, 1, 1, std::nextafter(2.0, 3.0))).value();
  EXPECT_FIELDS(above, (plan_id, 7), (step, 1), (coordinate, 1), (upper, 2));
  EXPECT_EQ(ledger_.FindDeparture(At(20, 7, 1, std::nextafter(1.0, 0.0), 1))->coordinate, 0);
  EXPECT_TRUE(ledger_.FindDeparture(At(30, 7, 1, std::numeric_limits<double>::quiet_NaN(), 1)));
}

TEST_F(ConformanceTest, TheEndOfTheOldPlanIsJudgedWhereAnotherTakesOver) {
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
TEST_F(ConformanceTest, APlanThatTheRobotSaysItHasStoppedIsNotJudgedWhereAnotherStarts) {
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
TEST_F(ConformanceTest, AStopHidesNoDepartureThatIsReported) {
  ledger_.Add(Plan(7), 0);
  ledger_.Add(Plan(8), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 0, 0.5, 0.5)));
  execution_event_t event{.plan_id = 7, .kind = execution_event_t::ERROR_STOP};
  ledger_.SeeStop(event, {});
  EXPECT_EQ(ledger_.FindDeparture(Step(0, 100, 100))->plan_id, 7) << "the whole step";
  EXPECT_EQ(ledger_.FindDeparture(At(1, 8, 0, 0.5, 1.5))->plan_id, 8);
  EXPECT_EQ(ledger_.FindDeparture(At(20, 7, 1, 0.5, 1.5))->plan_id, 7) << "it goes on with it";
}

TEST_F(ConformanceTest, StandingAndUnknownPlansAreNotJudged) {
  ledger_.Add(Plan(7), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 2, 2.5, 2.5)));
  EXPECT_FALSE(ledger_.FindDeparture(At(1, -1, -1, 100, 100))) << "standing is a hold mode of the robot";
  EXPECT_FALSE(ledger_.FindDeparture(At(2, 99, 0, 100, 100)));
  EXPECT_FALSE(ledger_.FindDeparture(At(3, 7, 4, 100, 100))) << "past the horizon";
  EXPECT_FALSE(ledger_.FindDeparture(At(5, 7, -1, 100, 100)));
}

TEST_F(ConformanceTest, TheSmallestSequenceDoesNotFollowTheLargest) {
  ledger_.Add(Plan(7), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(std::numeric_limits<std::int64_t>::max(), 7, 0, 0.5, 0.5)));
  EXPECT_FALSE(ledger_.FindDeparture(At(std::numeric_limits<std::int64_t>::min(), 99, 0, 100, 100)));
}

TEST_F(ConformanceTest, AnAngleMayDifferByWholeTurns) {
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

TEST_F(ConformanceTest, ASliceIsLeftByMoreThanTheStateErrorOnly) {
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

TEST_F(ConformanceTest, AStateMayBringItsOwnError) {
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

TEST_F(ConformanceTest, TheEndOfAStepMayBeOffByTheDeclaredError) {
  certified_plan_t plan = Plan(7);
  plan.state_error[0] = 0.25;
  ledger_.Add(plan, 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 7, 0, 0.5, 0.5)));
  EXPECT_FALSE(ledger_.FindDeparture(Step(0, 2.25, 2)));
  EXPECT_TRUE(ledger_.FindDeparture(Step(0, std::nextafter(2.25, 3), 2)));
}

TEST_F(ConformanceTest, TheEndOfAStepIsJudgedThoughTheRobotStandsThere) {
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

TEST_F(ConformanceTest, TheEndOfAStepIsJudgedThoughTheNextStateOvertookIt) {
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

TEST_F(ConformanceTest, TheEndOfAStepIsJudgedThoughAFasterRobotIsHeardInBetween) {
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
TEST_F(ConformanceTest, StatesAndTransitionsOfTwoSendersAreNotMixed) {
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

TEST_F(ConformanceTest, ANewCertificateOfTheSameIdCountsUnlessTheOldOneIsExecuted) {
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

TEST_F(ConformanceTest, ThePlanThatIsExecutedIsNotForgotten) {
  const auto count = static_cast<std::int64_t>(PlanLedger::kSlices);
  for (std::int64_t id = 0; id < count; ++id) ledger_.Add(Plan(id), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 0, 0, 0.5, 0.5)));
  for (std::int64_t id = count; id < 3 * count; ++id) ledger_.Add(Plan(id), 0);
  EXPECT_TRUE(ledger_.FindDeparture(At(10, 0, 1, 100, 100)));
  EXPECT_TRUE(ledger_.FindDeparture(At(20, 3 * count - 1, 0, 100, 100)));
  EXPECT_FALSE(ledger_.FindDeparture(At(30, 2 * count, 0, 100, 100))) << "the others are, in their order";
}

TEST_F(ConformanceTest, TheLastPlansAreRemembered) {
  const auto count = static_cast<std::int64_t>(PlanLedger::kSlices);
  for (std::int64_t id = 0; id <= count; ++id) ledger_.Add(Plan(id), 0);
  EXPECT_FALSE(ledger_.FindDeparture(At(0, 0, 0, 100, 100))) << "the first is forgotten";
  EXPECT_TRUE(ledger_.FindDeparture(At(10, 1, 0, 100, 100)));
  EXPECT_TRUE(ledger_.FindDeparture(At(20, count, 0, 100, 100)));
}

}  // namespace forereach::conformance_test
