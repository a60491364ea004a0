// What a robot's messages say of the times of its steps and of the clocks.
#include "cli/step_times.h"

#include "tests/test.h"

namespace forereach::step_times_test {

constexpr std::int64_t kStep = 100'000;

TEST(StepTimes, ABoundaryIsOffByWhatTheStepsBeforeItLastedLonger) {
  StepTimes times(kStep);
  std::int64_t utime = 1'000;
  for (const std::int64_t longer : {300, 400, -200, -1'300}) {
    times.HearStep(utime, kStep + longer);
    utime += kStep;
  }
  EXPECT_EQ(times.steps(), 4);
  EXPECT_EQ(times.step_error_us(), 800) << "300, 700, 500, -800";
  EXPECT_EQ(times.StepErrorMs(), 1.6);
}

TEST(StepTimes, AGapBeginsAnotherRun) {
  StepTimes times(kStep);
  times.HearStep(0, kStep + 500);
  times.HearStep(2 * kStep, kStep + 500);
  EXPECT_EQ(times.step_error_us(), 500);
  times.HearStep(3 * kStep, kStep + 500);
  EXPECT_EQ(times.step_error_us(), 1'000);
}

TEST(StepTimes, AClockIsOffByWhatArrivesBeforeItsStampOrLaterThanTheBusTakes) {
  StepTimes times(kStep);
  times.HearStamp(1'000'000, 1'000'400);
  EXPECT_EQ(times.ClockErrorMs(10), 0);
  times.HearStamp(2'000'000, 1'997'950);
  EXPECT_FIELDS(times, (least_delay_us(), -2'050), (ClockErrorMs(10), 4.1));
  times.HearStamp(3'000'000, 3'013'001);
  EXPECT_EQ(times.largest_delay_us(), 13'001);
  EXPECT_EQ(times.ClockErrorMs(10), 6.1) << "3.001 ms, twice, and up to a tenth";
  EXPECT_EQ(times.ClockErrorMs(0), 26.1);
}

TEST(StepTimes, SayWhatTheyRestOnAndProposeNothingUnheard) {
  StepTimes times(kStep);
  EXPECT_FALSE(times.StepErrorMs());
  EXPECT_FALSE(times.ClockErrorMs(10));
  EXPECT_THAT(times.Text(5, 10), AllOf(HasSubstr("steps: none in 5 s"), HasSubstr("neither states nor obstacles")));
  times.HearStep(0, kStep - 1'250);
  times.HearStamp(0, 500);
  EXPECT_THAT(times.Text(5, 10), AllOf(HasSubstr("steps: 1 in 5 s, boundaries up to 1.25 ms from their times"),
                                       HasSubstr("robot.step_error_ms: 2.5"),
                                       HasSubstr("1 states and obstacles in 5 s arrive 0.5 ms to 0.5 ms after"),
                                       HasSubstr("Proposed is 2 times the largest")));
}

TEST(StepTimes, TakeNoNonsense) {
  StepTimes times(kStep);
  times.HearStep(INT64_MIN, kStep);
  times.HearStep(0, INT64_MAX);
  times.HearStep(0, -1);
  times.HearStamp(INT64_MIN, 0);
  EXPECT_FIELDS(times, (steps(), 0), (stamps(), 0));
}

}  // namespace forereach::step_times_test
