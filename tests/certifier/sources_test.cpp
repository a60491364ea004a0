// The used plan_ids of a source, the forgotten sources, and the number of lost candidates.
#include "certifier/gate/sources.h"

#include "tests/test.h"

#include "lcmtypes/codec.h"

namespace forereach::sources_test {

using Admission = Sources::Admission;
constexpr std::int64_t kForget = 550'000;

candidate_plan_t From(const std::string& source, std::int64_t plan_id, std::int64_t sequence = 0) {
  candidate_plan_t candidate{};
  SetText(candidate.source, source);
  candidate.plan_id = plan_id;
  candidate.sequence = sequence;
  return candidate;
}

// Hears it and takes it at once.
Admission Take(Sources& sources, std::int64_t plan_id, std::int64_t sequence, std::int64_t utime, std::int64_t now) {
  candidate_plan_t candidate = From("a", plan_id, sequence);
  candidate.utime = utime;
  sources.Hear(candidate, now);
  return sources.Admit(candidate, now);
}

TEST(SourcesTest, AdmitsEachPlanIdOnceInAnyOrder) {
  Sources sources(kForget);
  for (const std::int64_t id : {10, 8, 9, 12, 11}) EXPECT_EQ(sources.Admit(From("a", id), 0), Admission::kNew) << id;
  for (const std::int64_t id : {8, 9, 10, 11, 12}) EXPECT_EQ(sources.Admit(From("a", id), 0), Admission::kUsed) << id;
  EXPECT_EQ(sources.Admit(From("b", 10), 0), Admission::kNew);
}

TEST(SourcesTest, TakesPlanIdsBelowTheWindowAsUsed) {
  Sources sources(kForget);
  EXPECT_EQ(sources.Admit(From("a", 5000), 0), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("a", 5000 - Sources::kWindow + 1), 0), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("a", 5000 - Sources::kWindow), 0), Admission::kUsed) << "too old to tell";
}

TEST(SourcesTest, AdmitsTheSmallestAndLargestPlanIds) {
  constexpr std::int64_t kLowest = std::numeric_limits<std::int64_t>::min(),
                         kHighest = std::numeric_limits<std::int64_t>::max();
  Sources sources(kForget);
  EXPECT_EQ(sources.Admit(From("a", kLowest), 0), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("a", kHighest), 0), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("a", kHighest), 0), Admission::kUsed);
  EXPECT_EQ(sources.Admit(From("a", kLowest), 0), Admission::kUsed);
}

TEST(SourcesTest, AgreesWithASetOfIdsInsideTheWindow) {
  FreshRandom random;
  Sources sources(kForget);
  std::set<std::int64_t> used;
  std::int64_t highest = 0;
  for (int i = 0; i < 20'000; ++i) {
    const std::int64_t id = highest + static_cast<std::int64_t>(random() % 1500) - 1400;
    const bool in_window = used.empty() || id > highest - Sources::kWindow;
    EXPECT_EQ(sources.Admit(From("a", id), 0) == Admission::kNew, in_window && used.insert(id).second) << id;
    if (in_window) highest = used.size() == 1 ? id : std::max(highest, id);
  }
}

TEST(SourcesTest, ForgetsSilentSourcesAndRecoversFromAHugePlanId) {
  Sources sources(kForget);
  for (int i = 0; i < 16; ++i) EXPECT_EQ(sources.Admit(From(std::to_string(i), 1), 0), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("17", 1), kForget), Admission::kTooManySources);
  EXPECT_EQ(sources.Admit(From("17", 1), kForget + 1), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("17", INT64_MAX), kForget + 1), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("17", 2), kForget + 2), Admission::kUsed);
  EXPECT_EQ(sources.Admit(From("17", 2), 2 * kForget + 2), Admission::kNew)
      << "what it sent then would be stale by now";
}

TEST(SourcesTest, AClockThatWasSetBackLocksNobodyOut) {
  Sources sources(kForget);
  EXPECT_EQ(sources.Admit(From("a", 1000), 1000 * kForget), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("a", 1000), 999 * kForget), Admission::kUsed);
  EXPECT_EQ(sources.Admit(From("a", 10), 0), Admission::kNew);
}

TEST(SourcesTest, RemembersInheritedPlanIdsForItsOwnTime) {
  Sources before(kForget), after(2 * kForget);
  static_cast<void>(Take(before, 1, 1, 0, 0));
  static_cast<void>(Take(before, 2, 3, 0, 0));
  after.Inherit(before);
  EXPECT_EQ(after.lost(), 1);
  EXPECT_EQ(after.Admit(From("a", 2), kForget + 1), Admission::kUsed);
  EXPECT_EQ(before.Admit(From("a", 2), kForget + 1), Admission::kNew);
}

TEST(SourcesTest, CountsGapsAndNotOrder) {
  Sources sources(kForget);
  constexpr std::int64_t kLater = 1000;
  const auto hear = [&](std::int64_t sequence, std::int64_t utime) {
    static_cast<void>(Take(sources, sequence, sequence, utime, kLater));
  };
  for (const std::int64_t sequence : {1, 4, 3, 0, 7}) hear(sequence, sequence);
  EXPECT_EQ(sources.lost(), 3) << "2, 5 and 6";
  hear(0, kLater);  // it began anew
  hear(1, kLater);
  EXPECT_EQ(sources.lost(), 3);
  hear(3, INT64_MAX);  // stamped wrongly
  EXPECT_EQ(sources.lost(), 4);
  hear(2, kLater);
  EXPECT_EQ(sources.lost(), 3);
  hear(INT64_MAX, kLater);
  hear(-5, kLater);
  EXPECT_EQ(sources.lost(), 3) << "no leap counts";
}

TEST(SourcesTest, CountsWhatIsMissingWhereTheNewestComeFirst) {
  Sources sources(kForget);
  std::int64_t now = 0;
  const auto take = [&](std::int64_t from, std::int64_t to) {
    for (std::int64_t sequence = from; sequence != to; sequence += from < to ? 1 : -1)
      static_cast<void>(Take(sources, sequence + 1, sequence, sequence, now));
  };
  for (std::int64_t batch = 0; batch < 100; ++batch, now += 1000) {  // as the node does in a flood
    take(100 * batch + 63, 100 * batch + 55);
    take(100 * batch, 100 * batch + 56);
  }
  EXPECT_EQ(sources.lost(), 99 * 36) << "64 to 99 of each hundred but the last";
}

// What a source has used is forgotten with time; what it sent is not counted as lost when it comes behind the newest.
TEST(SourcesTest, CountsLossesCorrectlyAcrossASilence) {
  Sources sources(kForget);
  std::int64_t now = 0;
  const auto take = [&](std::int64_t sequence) { return Take(sources, sequence, sequence, sequence, now); };
  EXPECT_EQ(take(1), Admission::kNew);
  now += kForget + 1;
  EXPECT_EQ(take(4000), Admission::kNew);
  for (std::int64_t sequence = 2; sequence < 3999; ++sequence) static_cast<void>(take(sequence));
  EXPECT_EQ(sources.lost(), 1) << "3999";
}

}  // namespace forereach::sources_test
