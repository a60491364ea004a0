// The clocks of a robot and of who sees obstacles, by stamps and arrivals.
#include "certifier/gate/stream_clock.h"

#include "tests/test.h"

#include "tests/certifier/small_task.h"

namespace forereach::stream_clock_test {

constexpr ClockBounds kClocks{60'000, 10'000};

std::string WhyOffBy(std::int64_t late_us) { return WhyOff({kNow, kNow + late_us}, kClocks); }

TEST(StreamClockTest, AMessageMayArriveLateByErrorAndDelayAndEarlyByTheErrorAlone) {
  for (const std::int64_t late_us : {0, 70'000, -60'000}) EXPECT_EQ(WhyOffBy(late_us), "") << late_us;
  EXPECT_THAT(WhyOffBy(70'001), HasSubstr("behind, or its messages are late"));
  EXPECT_THAT(WhyOffBy(-60'001), HasSubstr("ahead"));
}

TEST(StreamClockTest, ItSaysByHowMuchAndHowMuchIsAllowed) {
  EXPECT_EQ(WhyOffBy(473'000),
            "behind, or its messages are late: the last one arrived 473 ms after its stamp, at most 70 ms are allowed");
  EXPECT_EQ(WhyOffBy(-400'000), "ahead: the last message arrived 400 ms before its stamp, at most 60 ms are allowed");
}

TEST(StreamClockTest, NoStampIsTooFarOffToBeCompared) {
  for (const std::int64_t stamp : {INT64_MIN, std::int64_t{-1}, std::int64_t{0}})
    EXPECT_THAT(WhyOff({stamp, kNow}, kClocks), HasSubstr("behind")) << stamp;
  EXPECT_THAT(WhyOff({INT64_MAX, kNow}, kClocks), HasSubstr("ahead"));
}

// Each may be off by the whole error from the certifier's clock, but not in opposite directions.
TEST(StreamClockTest, TwoClocksMayNotBeFurtherApartThanErrorAndDelay) {
  const auto why = [](std::int64_t robot_late_us, std::int64_t obstacles_late_us) {
    return WhyApart({kNow, kNow + robot_late_us}, {kNow + 7, kNow + 7 + obstacles_late_us}, kClocks);
  };
  EXPECT_EQ(why(40'000, -30'000), "");
  EXPECT_EQ(why(-30'000, 40'000), "");
  EXPECT_EQ(why(70'000, 0), "");
  EXPECT_EQ(why(40'000, -30'001),
            "the clocks of the robot and of the obstacles' sender are apart: their messages arrive 40 ms after and "
            "30.001 ms before their stamps, at most 70 ms are allowed");
  EXPECT_THAT(why(-30'001, 40'000), HasSubstr("are apart"));
}

TEST(StreamClockTest, TheBoundsAreTheTasksAndWithoutAClockErrorThereAreNone) {
  Config config = SmallTask();
  EXPECT_FALSE(ClockBoundsOf(config));
  config.gate.max_clock_error_ms = 60;
  ASSERT_TRUE(ClockBoundsOf(config));
  EXPECT_EQ(ClockBoundsOf(config)->error_us, 60'000);
  EXPECT_EQ(ClockBoundsOf(config)->delay_us, 10'000) << "the default";
  EXPECT_EQ(ClockBoundsOf(config)->OfRobot().error_us, 60'000) << "half of it is for the robot's steps";
  config.gate.step_error_ms = 20;
  EXPECT_EQ(ClockBoundsOf(config)->OfRobot().error_us, 80'000);
  EXPECT_EQ(ClockBoundsOf(config)->error_us, 60'000) << "of the obstacles' sender";
  config.bus.delay_ms = 0.5;
  EXPECT_EQ(ClockBoundsOf(config)->delay_us, 500);
}

}  // namespace forereach::stream_clock_test
