#include "certifier/gate/watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forereach/decision_t.hpp"
#include "forereach/fault_t.hpp"

namespace forereach {
namespace watch_test {

using testing::HasSubstr;

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
    if (fault) {
      EXPECT_TRUE(watch.Latch({fault_t::CLOCK_JUMP, 1, "jumped"}));
    }
    const bool robot_lacks = unseen && needs_robot;
    const auto refusal = watch.WhyNot();
    SCOPED_TRACE(bits);
    EXPECT_EQ(refusal.has_value(), second || robot_lacks || unknown || fault);
    EXPECT_EQ(watch.state(), fault ? Watch::State::kFault : refusal ? Watch::State::kDisarmed : Watch::State::kArmed);
    if (!refusal) continue;
    EXPECT_EQ(refusal->cause, fault         ? decision_t::CAUSE_FAULT
                              : second      ? decision_t::CAUSE_SECOND_CERTIFIER
                              : robot_lacks ? decision_t::CAUSE_NOT_ARMED
                                            : decision_t::CAUSE_NO_OBSTACLES);
    EXPECT_EQ(refusal->outcome,
              refusal->cause == decision_t::CAUSE_NO_OBSTACLES ? decision_t::ABSTAIN_OBSTACLES : decision_t::REJECTED);
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

}  // namespace watch_test
}  // namespace forereach
