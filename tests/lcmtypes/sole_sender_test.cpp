// Who sends on a stream: one sender counts, two are in doubt, and one that has fallen silent is replaced.
#include "lcmtypes/sole_sender.h"

#include "tests/test.h"

namespace forereach::sole_sender_test {

using Place = SoleSender::Place;

constexpr std::int64_t kTimeout = 1'000'000, kHour = 3'600'000'000;
constexpr std::uint64_t kA = 0xa, kB = 0xb, kC = 0xc;

struct SoleSenderTest : testing::Test {
  // Every period until then; at `until` nothing is heard.
  void Hears(std::uint64_t who, std::int64_t from, std::int64_t until, std::int64_t period = kTimeout / 4) {
    for (std::int64_t t = from; t < until; t += period) sender_.Hear(who, t);
  }
  [[nodiscard]] bool IsAlone(std::int64_t now) const { return sender_.WhyNotAlone(now).empty(); }
  [[nodiscard]] bool AreTwo(std::int64_t now) const { return !sender_.WhyTwo(now).empty(); }

  SoleSender sender_{kTimeout};
};

TEST_F(SoleSenderTest, CountsOnceItWasHeardAloneForTheTimeout) {
  EXPECT_EQ(sender_.WhyNotAlone(0), "") << "nothing was heard: whether that is enough, others decide";
  EXPECT_EQ(sender_.counts(), std::nullopt);
  EXPECT_EQ(sender_.Hear(kA, 0), Place::kTakesOver);
  EXPECT_EQ(sender_.WhyNotAlone(120'000),
            "sender 000000000000000a has been heard for 120 ms; it counts after 1000 ms alone");
  Hears(kA, 1, kTimeout + 2);
  EXPECT_EQ(sender_.counts(), kA);
  EXPECT_FALSE(IsAlone(kTimeout));
  EXPECT_TRUE(IsAlone(kTimeout + 1));
  EXPECT_EQ(sender_.WhyTwo(0), "");
}

TEST_F(SoleSenderTest, ASecondOneIsInDoubtUntilItWasSilentForTheTimeout) {
  Hears(kA, 0, 3 * kTimeout);
  EXPECT_EQ(sender_.Hear(kB, 3 * kTimeout), Place::kOther);
  EXPECT_EQ(sender_.WhyTwo(3 * kTimeout),
            "two senders are heard, 000000000000000a and 000000000000000b: one of them has to end");
  Hears(kA, 3 * kTimeout, 5 * kTimeout);
  EXPECT_TRUE(AreTwo(4 * kTimeout));
  EXPECT_FALSE(AreTwo(4 * kTimeout + 1));
  EXPECT_TRUE(IsAlone(4 * kTimeout + 1)) << "the first one was heard all the time";
  EXPECT_EQ(sender_.counts(), kA);
}

TEST_F(SoleSenderTest, ARestartedOneTakesOverAfterTheTimeoutAndNotLater) {
  Hears(kA, 0, 2 * kTimeout);
  sender_.Hear(kA, 2 * kTimeout);
  for (std::int64_t t = 2 * kTimeout + 1000; t <= 3 * kTimeout; t += 1000)
    ASSERT_EQ(sender_.Hear(kB, t), Place::kOther) << t;
  EXPECT_EQ(sender_.Hear(kB, 3 * kTimeout + 1), Place::kTakesOver);
  EXPECT_FALSE(IsAlone(3 * kTimeout + 1000));
  EXPECT_TRUE(IsAlone(3 * kTimeout + 1001)) << "it was heard for the timeout by then";
  EXPECT_EQ(sender_.Hear(kA, 3 * kTimeout + 2000), Place::kOther) << "the first one is back";
  EXPECT_TRUE(AreTwo(3 * kTimeout + 2000));
}

TEST_F(SoleSenderTest, AfterALongSilenceItIsLikeTheFirst) {
  Hears(kA, 0, 2 * kTimeout);
  EXPECT_EQ(sender_.Hear(kB, kHour), Place::kTakesOver);
  EXPECT_FALSE(AreTwo(kHour));
  EXPECT_FALSE(IsAlone(kHour + kTimeout));
  EXPECT_TRUE(IsAlone(kHour + kTimeout + 1));
  EXPECT_EQ(sender_.Hear(kB, 2 * kHour), Place::kGoesOn);
  EXPECT_FALSE(IsAlone(2 * kHour)) << "a second one may have begun meanwhile";
}

// At whatever rates, and whoever is first.
TEST_F(SoleSenderTest, TwoThatAlternateNeverCount) {
  FreshRandom random;
  for (int i = 0; i < 200; ++i) {
    sender_ = SoleSender(kTimeout);
    const auto period = [&] { return std::uniform_int_distribution<std::int64_t>(1000, kTimeout)(random); };
    const std::int64_t of_a = period(), of_b = period();
    std::int64_t next_a = 0, next_b = std::uniform_int_distribution<std::int64_t>(0, kTimeout)(random);
    while (std::min(next_a, next_b) < 10 * kTimeout) {
      const std::int64_t now = std::min(next_a, next_b);
      ASSERT_FALSE(now > 0 && IsAlone(now)) << now << ": " << of_a << " and " << of_b;
      sender_.Hear(now == next_a ? kA : kB, now);
      ASSERT_FALSE(IsAlone(now)) << now << ": " << of_a << " and " << of_b;
      (now == next_a ? next_a : next_b) += now == next_a ? of_a : of_b;
    }
  }
}

TEST_F(SoleSenderTest, AFloodOfSendersLeavesTheFirstInPlaceAndEnds) {
  Hears(kA, 0, 2 * kTimeout);
  std::uint64_t id = 1000;
  for (std::int64_t t = 2 * kTimeout; t < 4 * kTimeout; t += 1000) {
    EXPECT_EQ(sender_.Hear(id++, t), Place::kOther);
    if (t % 250'000 == 0) sender_.Hear(kA, t);
    EXPECT_TRUE(AreTwo(t));
  }
  Hears(kA, 4 * kTimeout, 6 * kTimeout);
  EXPECT_EQ(sender_.counts(), kA);
  EXPECT_TRUE(IsAlone(5 * kTimeout)) << "the last of them came a little before 4";
}

TEST_F(SoleSenderTest, OfThreeTheLastLeftCounts) {
  Hears(kA, 0, 2 * kTimeout);
  Hears(kB, 2 * kTimeout, 5 * kTimeout);
  Hears(kC, 5 * kTimeout, 8 * kTimeout);
  EXPECT_EQ(sender_.counts(), kC);
  EXPECT_TRUE(IsAlone(8 * kTimeout - 1));
}

TEST_F(SoleSenderTest, AClockSetBackLocksNobodyOutForThatTime) {
  Hears(kA, 10 * kHour, 10 * kHour + 2 * kTimeout);
  EXPECT_FALSE(IsAlone(0));
  EXPECT_EQ(sender_.Hear(kB, 0), Place::kOther) << "the first one may still be there";
  EXPECT_TRUE(AreTwo(kTimeout));
  EXPECT_EQ(sender_.Hear(kB, kTimeout), Place::kOther);
  EXPECT_EQ(sender_.Hear(kB, kTimeout + 1), Place::kTakesOver);
  EXPECT_TRUE(IsAlone(kTimeout + 1)) << "it was heard for the timeout";
}

TEST_F(SoleSenderTest, AClockSetAheadNeverEndsADoubtForLong) {
  Hears(kA, 0, 2 * kTimeout);
  EXPECT_EQ(sender_.Hear(kB, kHour), Place::kTakesOver);
  EXPECT_FALSE(IsAlone(kHour)) << "it is taken for a silence, and waited again";
  sender_.Hear(kA, kHour + 1);
  EXPECT_TRUE(AreTwo(kHour + 1));
}

TEST_F(SoleSenderTest, WithoutSignaturesItKnowsNoDifference) {
  for (std::int64_t t = 0; t < 3; ++t) {
    EXPECT_EQ(sender_.Hear(std::nullopt, t), Place::kGoesOn);
    EXPECT_TRUE(IsAlone(t));
  }
}

TEST_F(SoleSenderTest, FollowsAnotherTimeout) {
  Hears(kA, 0, 2 * kTimeout);
  sender_.Follow(10 * kTimeout);
  EXPECT_FALSE(IsAlone(2 * kTimeout));
  EXPECT_EQ(sender_.Hear(kB, 10 * kTimeout), Place::kOther);
}

TEST_F(SoleSenderTest, TakesAnyTimes) {
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min(),
                         kMost = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t time : {kMost, kLeast, kMost, std::int64_t{0}, kLeast}) {
    sender_.Hear(kA, time);
    sender_.Hear(kB, time);
    EXPECT_TRUE(AreTwo(time));
    EXPECT_FALSE(IsAlone(time));
  }
}

}  // namespace forereach::sole_sender_test
