// Which plan_ids a source has used, who is forgotten, what was lost.
#include "certifier/gate/sources.h"

#include <limits>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "lcmtypes/codec.h"

namespace forereach {
namespace {

using Admission = Sources::Admission;
constexpr std::int64_t kForget = 550'000;

candidate_plan_t From(const std::string& source, std::int64_t plan_id, std::int64_t sequence = 0) {
  candidate_plan_t candidate{};
  SetText(candidate.source, source);
  candidate.plan_id = plan_id;
  candidate.sequence = sequence;
  return candidate;
}

TEST(SourcesTest, EachPlanIdOnceInAnyOrder) {
  Sources sources(kForget);
  for (const std::int64_t id : {10, 8, 9, 12, 11}) EXPECT_EQ(sources.Admit(From("a", id), 0), Admission::kNew) << id;
  for (const std::int64_t id : {8, 9, 10, 11, 12}) EXPECT_EQ(sources.Admit(From("a", id), 0), Admission::kUsed) << id;
  EXPECT_EQ(sources.Admit(From("b", 10), 0), Admission::kNew);
}

TEST(SourcesTest, TheWindowEndsWhereItSays) {
  Sources sources(kForget);
  EXPECT_EQ(sources.Admit(From("a", 5000), 0), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("a", 5000 - Sources::kWindow + 1), 0), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("a", 5000 - Sources::kWindow), 0), Admission::kUsed) << "too old to tell";
}

TEST(SourcesTest, ExtremeIdsAreIdsLikeOthers) {
  constexpr std::int64_t kLowest = std::numeric_limits<std::int64_t>::min(), kHighest = std::numeric_limits<std::int64_t>::max();
  Sources sources(kForget);
  EXPECT_EQ(sources.Admit(From("a", kLowest), 0), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("a", kHighest), 0), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("a", kHighest), 0), Admission::kUsed);
  EXPECT_EQ(sources.Admit(From("a", kLowest), 0), Admission::kUsed);
}

TEST(SourcesTest, AgreesWithASetOfIdsInsideTheWindow) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
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

TEST(SourcesTest, SilentSourcesMakeRoomAndAHugeIdLocksNobodyOutForLong) {
  Sources sources(kForget);
  for (int i = 0; i < 16; ++i) EXPECT_EQ(sources.Admit(From(std::to_string(i), 1), 0), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("17", 1), kForget), Admission::kTooManySources);
  EXPECT_EQ(sources.Admit(From("17", 1), kForget + 1), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("17", INT64_MAX), kForget + 1), Admission::kNew);
  EXPECT_EQ(sources.Admit(From("17", 2), kForget + 2), Admission::kUsed);
  EXPECT_EQ(sources.Admit(From("17", 2), 2 * kForget + 2), Admission::kNew) << "what it sent then would be stale by now";
}

TEST(SourcesTest, CountsGapsAndNotOrder) {
  Sources sources(kForget);
  const auto hear = [&](std::int64_t sequence) {
    const candidate_plan_t candidate = From("a", sequence, sequence);
    sources.Hear(candidate);
    static_cast<void>(sources.Admit(candidate, 0));
  };
  for (const std::int64_t sequence : {0, 1, 4, 3, 7}) hear(sequence);
  EXPECT_EQ(sources.lost(), 3) << "2, 5 and 6";
  hear(0);  // it started again
  hear(1);
  EXPECT_EQ(sources.lost(), 3);
  hear(INT64_MAX);
  hear(-5);
  EXPECT_EQ(sources.lost(), 3) << "no leap counts";
}

TEST(SourcesTest, CountsWhatIsMissingWhereTheNewestComeFirst) {
  Sources sources(kForget);
  std::int64_t now = 0;
  const auto take = [&](std::int64_t from, std::int64_t to) {
    for (std::int64_t sequence = from; sequence != to; sequence += from < to ? 1 : -1) {
      const candidate_plan_t candidate = From("a", sequence + 1, sequence);
      sources.Hear(candidate);
      static_cast<void>(sources.Admit(candidate, now));
    }
  };
  for (std::int64_t batch = 0; batch < 100; ++batch, now += 1000) {  // as the node does in a flood
    take(100 * batch + 63, 100 * batch + 55);
    take(100 * batch, 100 * batch + 56);
  }
  // 64 to 99 of each hundred but the last; and the eight that came before 0, which count as of a run before.
  EXPECT_EQ(sources.lost(), 99 * 36 + 8);
}

}  // namespace
}  // namespace forereach
