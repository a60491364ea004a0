#include "certifier/gate/watch.h"

#include "tests/messages.h"
#include "tests/test.h"

namespace forereach::watch_test {

constexpr WatchOptions kOptions{true, 1000, 200};

// Every combination of what may be lacking, with a fault and without, in a task that needs the robot's state and in one
// that does not.
TEST(WatchTest, IsArmedIfNothingIsLackingAndSaysAllThatIs) {
  for (unsigned bits = 0; bits < 32; ++bits) {
    const bool second = bits & 1, unseen = bits & 2, unknown = bits & 4, fault = bits & 8, needs_robot = bits & 16;
    Watch watch({needs_robot, 1000, 200});
    if (second) watch.Set(Watch::Need::kCharge, "another");
    if (unknown) watch.Set(Watch::Need::kObstacles, "unseen");
    if (!unseen) watch.SeeRobot(0);
    if (fault) EXPECT_TRUE(watch.Latch({fault_t::CLOCK_JUMP, 1, "jumped"}));
    const bool robot_lacks = unseen && needs_robot;
    const auto refusal = watch.WhyNot();
    SCOPED_TRACE(bits);
    EXPECT_EQ(refusal.has_value(), second || robot_lacks || unknown || fault);
    EXPECT_EQ(watch.state(), fault ? Watch::State::kFault : refusal ? Watch::State::kDisarmed : Watch::State::kArmed);
    if (!refusal) continue;
    EXPECT_FIELDS(*refusal,
                  (cause, fault         ? decision_t::CAUSE_FAULT
                          : second      ? decision_t::CAUSE_SECOND_CERTIFIER
                          : robot_lacks ? decision_t::CAUSE_NOT_ARMED
                                        : decision_t::CAUSE_NO_OBSTACLES),
                  (outcome, refusal->cause == decision_t::CAUSE_NO_OBSTACLES ? decision_t::ABSTAIN_OBSTACLES
                                                                             : decision_t::REJECTED));
    if (fault) {
      EXPECT_EQ(refusal->why, "fault: jumped");
      continue;
    }
    const auto says = [&](const char* what) { return refusal->why.find(what) != std::string::npos; };
    EXPECT_EQ(says("another"), second);
    EXPECT_EQ(says("the robot's state"), robot_lacks);
    EXPECT_EQ(says("unseen"), unknown);
  }
}

TEST(WatchTest, ANeedThatIsMetAgainArmsByItself) {
  Watch watch(kOptions);
  watch.SeeRobot(0);
  for (int i = 0; i < 3; ++i) {
    watch.Set(Watch::Need::kObstacles, "waits for OBSTACLES");
    EXPECT_EQ(watch.state(), Watch::State::kDisarmed);
    EXPECT_FALSE(watch.Advance(500, 500)) << "it is no fault";
    watch.Set(Watch::Need::kObstacles, "");
    EXPECT_EQ(watch.state(), Watch::State::kArmed);
  }
}

TEST(WatchTest, AResetAsksForTheRobotAnewAndForgetsNoOtherNeed) {
  Watch watch(kOptions);
  watch.SeeRobot(0);
  watch.Set(Watch::Need::kObstacles, "unseen");
  ASSERT_TRUE(watch.Latch({fault_t::SLICE_LEFT, 1, "left"}));
  EXPECT_TRUE(watch.Reset());
  EXPECT_FALSE(watch.Reset());
  EXPECT_EQ(watch.WhyNot()->why, "waits for the robot's state; unseen");
  watch.SeeRobot(2);
  EXPECT_EQ(watch.WhyNot()->cause, decision_t::CAUSE_NO_OBSTACLES);
}

TEST(WatchTest, ALostRobotLatchesAndALaterFaultThatStopsItTakesItsPlace) {
  Watch watch(kOptions);
  watch.SeeRobot(0);
  EXPECT_FALSE(watch.Advance(1000, 1000));
  ASSERT_TRUE(watch.Advance(1001, 1001));
  EXPECT_EQ(watch.fault()->cause, fault_t::ROBOT_STATE_LOST);
  EXPECT_FALSE(watch.Latch({fault_t::CLOCK_JUMP, 2, "jumped"}));
  EXPECT_TRUE(watch.Latch({fault_t::SLICE_LEFT, 3, "left"}));
  EXPECT_FALSE(watch.Latch({fault_t::DECLARATION_FALSIFIED, 4, "false"}));
  EXPECT_EQ(watch.fault()->cause, fault_t::SLICE_LEFT);
}

// Its states come, and are queued. What a process did not hear while it was stopped is not the robot's silence.
TEST(WatchTest, ACertifierThatWasStoppedSaysSoAndNotTheRobotAlone) {
  Watch watch({true, 1'000'000, 200});
  for (std::int64_t us = 0; us <= 85'000; us += 5'000) {
    if (us <= 80'000) watch.SeeRobot(us);
    EXPECT_FALSE(watch.Advance(us, us));
  }
  const auto fault = watch.Advance(1'995'000, 1'995'000);
  ASSERT_TRUE(fault) << "it stays a fault";
  EXPECT_FIELDS(
      *fault, (cause, fault_t::ROBOT_STATE_LOST),
      (why,
       "the robot's state was last heard 1915 ms ago, at most 1000 ms are allowed: this certifier itself did not "
       "run for 1910 ms"));
}

TEST(WatchTest, ARobotThatIsSilentWhileTheCertifierRunsIsBlamedAlone) {
  Watch watch({true, 1'000'000, 200});
  watch.Advance(0, 0);
  watch.Advance(500'000, 500'000);  // a pause before it was heard
  watch.SeeRobot(500'000);
  std::optional<Watch::Fault> fault;
  for (std::int64_t us = 500'000; us <= 1'600'000 && !fault; us += 50'000) fault = watch.Advance(us, us);
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->why, "the robot's state was last heard 1050 ms ago, at most 1000 ms are allowed");
}

TEST(WatchTest, IsArmedOnlyWhileTheNewestStampsAreInside) {
  Watch watch({true, 1'000'000, 200, ClockBounds{60'000, 10'000}});
  watch.SeeRobot(0);
  const auto see = [&](std::int64_t robot_late_us, std::optional<std::int64_t> obstacles_late_us) {
    watch.SeeStamps(Arrival{0, robot_late_us},
                    obstacles_late_us ? std::optional(Arrival{0, *obstacles_late_us}) : std::nullopt);
    return watch.WhyNot();
  };
  EXPECT_FALSE(see(70'000, std::nullopt));
  EXPECT_FALSE(see(-60'000, std::nullopt));
  ASSERT_TRUE(see(70'001, std::nullopt));
  EXPECT_FIELDS(watch, (WhyNot()->cause, decision_t::CAUSE_NOT_ARMED), (WhyNot()->outcome, decision_t::REJECTED),
                (state(), Watch::State::kDisarmed));
  EXPECT_THAT(watch.WhyNot()->why, HasSubstr("the robot's clock is behind"));
  EXPECT_FALSE(see(0, std::nullopt)) << "the next one decides anew";
  EXPECT_THAT(see(-60'001, std::nullopt)->why, HasSubstr("the robot's clock is ahead"));
  EXPECT_FALSE(see(40'000, -30'000));
  EXPECT_THAT(see(40'000, -30'001)->why, HasSubstr("are apart"));
  EXPECT_FALSE(see(40'000, -60'001)) << "the obstacles are unknown then, which is said as another need";
  watch.SeeStamps(std::nullopt, std::nullopt);
  EXPECT_FALSE(watch.WhyNot());
}

// Its stamp is when the boundary is due.
TEST(WatchTest, ARobotMayMeasureAStateAsFarOffItsStampAsAStepMayBe) {
  Watch watch({true, 1'000'000, 200, ClockBounds{60'000, 10'000, 20'000}});
  watch.SeeRobot(0);
  const auto why = [&](std::int64_t robot_late_us, std::int64_t obstacles_late_us) {
    watch.SeeStamps(Arrival{0, robot_late_us}, Arrival{0, obstacles_late_us});
    return watch.WhyNot() ? watch.WhyNot()->why : "";
  };
  EXPECT_EQ(why(-80'000, -10'000), "");
  EXPECT_THAT(why(-80'001, -20'000),
              HasSubstr("ahead: the last message arrived 80 ms before its stamp, at most 80 ms"));
  EXPECT_EQ(why(90'000, 0), "");
  EXPECT_THAT(why(90'001, 20'000), HasSubstr("at most 90 ms"));
  EXPECT_EQ(why(50'000, -40'000), "");
  EXPECT_THAT(why(50'000, -40'001), HasSubstr("are apart"));
}

TEST(WatchTest, WithoutAClockErrorStampsAreNotCompared) {
  Watch watch(kOptions);
  watch.SeeRobot(0);
  watch.SeeStamps(Arrival{0, 400'000}, Arrival{0, -400'000});
  EXPECT_EQ(watch.state(), Watch::State::kArmed);
}

TEST(WatchTest, ARobotThatIsLostForItsStampsIsNotCalledSilentOnly) {
  Watch watch({true, 1'000'000, 200, ClockBounds{60'000, 10'000}});
  watch.SeeRobot(0);
  watch.SeeStamps(Arrival{0, 600'000}, std::nullopt);
  std::optional<Watch::Fault> fault;
  for (std::int64_t us = 0; us <= 1'100'000 && !fault; us += 50'000) fault = watch.Advance(us, us);
  ASSERT_TRUE(fault);
  EXPECT_THAT(fault->why, HasSubstr("; the robot's clock is behind"));
}

TEST(WatchTest, AClockThatJumpsForwardOrBackIsAFault) {
  constexpr std::int64_t kBegin = 1'000'000, kMost = 200;
  for (const std::int64_t direction : {1, -1}) {
    Watch watch({false, 1000, kMost});
    EXPECT_FALSE(watch.Advance(kBegin, 10));
    EXPECT_FALSE(watch.Advance(kBegin + 50 + direction * kMost, 60)) << "as far as it may";
    EXPECT_FALSE(watch.Advance(kBegin + 100 + 2 * direction * kMost, 110)) << "it counts from where it was last";
    const auto fault = watch.Advance(kBegin + 150 + 3 * direction * kMost + direction, 160);
    ASSERT_TRUE(fault) << direction;
    EXPECT_EQ(fault->cause, fault_t::CLOCK_JUMP);
    EXPECT_EQ(watch.state(), Watch::State::kFault);
  }
}

TEST(WatchTest, OptionsThatAreFollowedDecideWhetherTheRobotIsNeeded) {
  Watch watch({false, 1000, 200});
  EXPECT_EQ(watch.state(), Watch::State::kArmed);
  watch.Follow(kOptions);
  EXPECT_EQ(watch.state(), Watch::State::kDisarmed);
  watch.SeeRobot(0);
  watch.RobotHasFinished();
  EXPECT_EQ(watch.state(), Watch::State::kDisarmed);
  watch.Follow({false, 1000, 200});
  EXPECT_EQ(watch.state(), Watch::State::kArmed);
}

}  // namespace forereach::watch_test
