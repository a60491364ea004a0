// The ledger of certified plans: which of them may be executing, at the boundaries of time and step.
#include "certifier/gate/plan_ledger.h"

#include "tests/test.h"

namespace forereach::issued_plans_test {

constexpr std::int64_t kStep = 100'000, kLifetime = 2'000'000, kAge = 500'000, kSteady = 5'000'000;
constexpr std::int64_t kWall = 1'700'000'000'000'000;

struct IssuedPlansTest : testing::Test {
  static GateOptions Gate() {
    return {.max_age_ms = kAge / 1e3, .certificate_lifetime_ms = kLifetime / 1e3, .longest_step_ms = kStep / 1e3};
  }
  static std::int64_t Life(int steps) { return kLifetime + 2 * kAge + steps * kStep; }

  // Certified at kWall, by the clock that nobody sets at kLater.
  static certified_plan_t Plan(std::int64_t plan_id, int steps = 10) {
    certified_plan_t certified{.utime = kWall, .expires_utime = kWall + kLifetime};
    certified.plan.plan_id = plan_id;
    certified.plan.num_steps = static_cast<std::int16_t>(steps);
    certified.plan.step_us = kStep;
    return certified;
  }
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

TEST_F(IssuedPlansTest, ToleratesUnknownPlansUntilThoseOfAnEarlierCertifierHaveEnded) {
  EXPECT_EQ(Judge(Executing(1, 0), kLater - 1), "");
  EXPECT_THAT(Judge(Executing(1, 0), kLater), HasSubstr("plan 1, which was not certified"));
  EXPECT_THAT(Judge(Executing(-1, -1), kLater), HasSubstr("plan -1, which was not certified"));
  robot_state_t standing = Executing(1, 0);
  for (const std::int16_t mode : {robot_state_t::STANDING, robot_state_t::FINISHED}) {
    standing.mode = mode;
    EXPECT_EQ(Judge(standing, kLater), "");
  }
}

TEST_F(IssuedPlansTest, AllowsAKnownPlanUntilItsEndAndNoLonger) {
  issued_.Add(Plan(1), kLater);
  EXPECT_EQ(Judge(Executing(1, 9), kLater + Life(10)), "");
  EXPECT_THAT(Judge(Executing(1, 9), kLater + Life(10) + 1), HasSubstr("should have ended"));
  EXPECT_THAT(Judge(Executing(2, 0), kLater), HasSubstr("plan 2, which was not certified"));
}

TEST_F(IssuedPlansTest, RefusesAStepThatThePlanDoesNotHave) {
  issued_.Add(Plan(1), kLater);
  EXPECT_EQ(Judge(Executing(1, 0), kLater), "");
  EXPECT_EQ(Judge(Executing(1, 9), kLater), "");
  EXPECT_THAT(Judge(Executing(1, 10), kLater), HasSubstr("plan 1, step 10 of 10"));
  EXPECT_THAT(Judge(Executing(1, -1), kLater), HasSubstr("plan 1, step -1 of 10"));
  issued_.Add(Plan(2), kSteady);
  EXPECT_THAT(Judge(Executing(2, 10), kSteady), HasSubstr("step 10 of 10")) << "also while unknown plans are tolerated";
  issued_.Add(Plan(1, 20), kLater);
  EXPECT_EQ(Judge(Executing(1, 10), kLater), "") << "another source has used its number";
}

TEST_F(IssuedPlansTest, RefusesAPlanThatBeganAfterItExpired) {
  const std::int64_t latest = kWall + kLifetime + kAge;
  for (const int step : {0, 9}) {
    PlanLedger issued(Gate(), kSteady);
    issued.Add(Plan(1), kLater);
    const auto late = issued.FindStranger(Executing(1, step, latest + 1 + step * kStep), kLater).value();
    EXPECT_THAT(late.why, HasSubstr("plan 1, which began 500 ms after its certificate had expired"));
    EXPECT_FALSE(issued.FindStranger(Executing(1, step, latest + step * kStep), kLater));
    EXPECT_FALSE(issued.FindStranger(Executing(1, step, latest + 3'600'000'000), kLater))
        << "the clock was set meanwhile";
  }
}

TEST_F(IssuedPlansTest, SurvivesNumbersOfAnySize) {
  certified_plan_t odd = Plan(1);
  odd.plan.step_us = INT64_MIN;
  issued_.Add(odd, kLater);
  static_cast<void>(Judge(Executing(1, 9, INT64_MAX), kLater));
  static_cast<void>(Judge(Executing(1, 9, INT64_MIN), kLater));
}

// What is pushed out by a flood of certificates may still be executing.
TEST_F(IssuedPlansTest, ToleratesAPlanThatAFloodOfCertificatesPushedOut) {
  issued_.Add(Plan(1), kLater);
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

TEST_F(IssuedPlansTest, AFloodOfCertificatesDoesNotPushOutThePlanThatIsExecuted) {
  issued_.Add(Plan(1000), kLater);
  for (std::size_t i = 0; i < PlanLedger::kPlans - 1; ++i) issued_.Add(Plan(1), kLater);
  issued_.SeeRobot(Executing(1000, 0), kLater);
  ASSERT_EQ(issued_.num_in_force(), 1u);
  for (int i = 0; i < 3; ++i) issued_.Add(Plan(1001), kLater);
  EXPECT_EQ(issued_.num_in_force(), 4u);
  EXPECT_THAT(Judge(Executing(1000, 10), kLater + 1), HasSubstr("step 10 of 10")) << "remembered";
}

TEST_F(IssuedPlansTest, AnotherCertifierBeginsTheToleranceAnewAReloadDoesNot) {
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

}  // namespace forereach::issued_plans_test
