#include "certifier/gate/pauses.h"

#include "tests/test.h"

namespace forereach::pauses_test {

constexpr std::int64_t kEpoch = 1'700'000'000'000'000, kSecond = 1'000'000;

// The monotonic clock began at another time.
void Call(Pauses& pauses, std::int64_t us) { pauses.Call(kEpoch + us, us + 5); }

TEST(PausesTest, ATimeBetweenTwoCallsIsAPauseIfItIsLongerThanATurn) {
  Pauses pauses;
  Call(pauses, 0);
  Call(pauses, Pauses::kPauseUs);
  EXPECT_EQ(pauses.Since(kEpoch), 0);
  Call(pauses, 2 * Pauses::kPauseUs + 1);
  EXPECT_EQ(pauses.Since(kEpoch), Pauses::kPauseUs + 1);
}

TEST(PausesTest, OnlyWhatLiesAfterATimeCountsSinceIt) {
  Pauses pauses;
  Call(pauses, 0);
  Call(pauses, 2 * kSecond);
  EXPECT_EQ(pauses.Since(kEpoch + kSecond / 2), kSecond * 3 / 2);
  EXPECT_EQ(pauses.Since(kEpoch + 2 * kSecond), 0);
  EXPECT_EQ(pauses.Since(kEpoch + 3 * kSecond), 0);
  Call(pauses, 3 * kSecond);
  EXPECT_EQ(pauses.Since(kEpoch + kSecond), 2 * kSecond);
}

TEST(PausesTest, ExplainsWhatIsTooOldOnlyIfItIsNotSoWithoutThePause) {
  Pauses pauses;
  Call(pauses, 0);
  Call(pauses, 500'000);  // a pause of half a second
  EXPECT_EQ(pauses.Explain(kEpoch, 500'000), "") << "it is not too old";
  EXPECT_EQ(pauses.Explain(kEpoch, 499'999), ": this certifier itself did not run for 500 ms");
  EXPECT_EQ(pauses.Explain(kEpoch, 400'000), ": this certifier itself did not run for 500 ms");
  for (std::int64_t us = 500'000; us <= 900'000; us += 50'000) Call(pauses, us);
  EXPECT_EQ(pauses.Explain(kEpoch, 400'000), ": this certifier itself did not run for 500 ms")
      << "0.4 s of silence while it ran";
  Call(pauses, 900'001);
  EXPECT_EQ(pauses.Explain(kEpoch, 400'000), "") << "longer than is allowed, without the pause";
}

TEST(PausesTest, ManyPausesTakeNoMoreMemoryAndTheLastOnesCount) {
  Pauses pauses;
  for (std::int64_t i = 0; i <= 1000; ++i) Call(pauses, i * kSecond);
  EXPECT_EQ(pauses.Since(kEpoch), static_cast<std::int64_t>(Pauses::kRemembered) * kSecond);
}

}  // namespace forereach::pauses_test
