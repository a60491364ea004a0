// The seal of a certified plan: its parts, and that every change of the message breaks it.
#include "lcmtypes/seal.h"

#include <set>

#include "tests/test.h"

#include "tests/robot/sealed_plan.h"

namespace forereach::seal_test {

using Kind = SealFault::Kind;

constexpr int kAllStates = 16, kAllSlices = 129;
constexpr std::size_t kFingerprint = 8, kRow = kAllStates * sizeof(double);

certified_plan_t Plan(int states, int steps) {
  certified_plan_t certified{.utime = 1'700'000'000'000'000, .sequence = 3};
  certified.expires_utime = certified.utime + 2'000'000;
  certified.plan.plan_id = 7;
  certified.plan.num_states = static_cast<std::int16_t>(states);
  certified.plan.num_inputs = 2;
  certified.plan.num_steps = static_cast<std::int16_t>(steps);
  certified.plan.control[steps - 1][1] = 0.25;
  for (int t = 0; t <= steps; ++t)
    for (int k = 0; k < states; ++k) {
      certified.slice_lower[t][k] = -1 - t - 0.1 * k;
      certified.slice_upper[t][k] = 1 + t + 0.1 * k;
    }
  for (int k = 0; k < states; ++k) certified.state_error[k] = 0.01 * (k + 1);
  certified.step_error_us = 3000;
  NameGrounds(certified);
  Seal(certified);
  return certified;
}

std::vector<Kind> FaultsAfter(const auto& change) {
  certified_plan_t certified = Plan(6, 12);
  change(certified);
  std::vector<Kind> kinds;
  for (const SealFault& fault : FindSealFaults(certified)) kinds.push_back(fault.kind);
  return kinds;
}

TEST(Seal, HoldsFromTheSmallestPlanToTheLargest) {
  for (const auto& [states, steps] : {std::pair(1, 1), {6, 12}, {16, 1}, {1, 128}, {16, 128}})
    EXPECT_THAT(FindSealFaults(Plan(states, steps)), IsEmpty()) << states << " " << steps;
}

// The definition in other words: the digest of the length and of the bytes without the zeros at their end.
Digest PlanDigestAsDefined(Bytes bytes) {
  const auto number = BigEndian(std::int64_t{std::ssize(bytes)});
  std::vector<std::uint8_t> all(number.begin(), number.end());
  all.insert(all.end(), bytes.begin(), bytes.end());
  while (all.size() > number.size() && all.back() == 0) all.pop_back();
  return DigestOf(all);
}

TEST(PlanDigest, IsOfTheLengthAndTheBytesUpToTheLastThatIsNotZero) {
  for (std::size_t size : {0, 1, 255, 256, 257, 511, 512, 513, 8536})
    for (std::size_t last : {0, 1, 8, 255, 256, 257, 511, 512, 513, 8535}) {
      std::vector<std::uint8_t> bytes(size);
      EXPECT_EQ(PlanDigest(Bytes(bytes)), PlanDigestAsDefined(bytes)) << size;
      if (last < size) bytes[last] = 1;
      EXPECT_EQ(PlanDigest(Bytes(bytes)), PlanDigestAsDefined(bytes)) << size << " " << last;
    }
}

TEST(PlanDigest, ChangesWithEachByteOfACandidate) {
  const std::vector<std::uint8_t> bytes = Encode(Plan(6, 12).plan);
  std::set<Digest> digests{PlanDigest(Bytes(bytes))};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::vector<std::uint8_t> changed = bytes;
    changed[i] ^= 1;
    EXPECT_TRUE(digests.insert(PlanDigest(Bytes(changed))).second) << "byte " << i;
  }
}

TEST(PlanDigest, ChangesWithZerosAtTheEnd) {
  std::set<Digest> digests;
  for (std::size_t size = 0; size < 600; ++size)
    EXPECT_TRUE(digests.insert(PlanDigest(Bytes(std::vector<std::uint8_t>(size)))).second) << size;
}

// The definition, read off the message as it is on the bus.
TEST(Seal, DigestIsOfTheBytesOnTheBusThatAreInUse) {
  for (const auto& [states, steps] : {std::pair(1, 1), {6, 12}, {16, 128}}) {
    const certified_plan_t certified = Plan(states, steps);
    const std::vector<std::uint8_t> message = Encode(certified);
    std::vector<std::uint8_t> covered;
    const auto cover = [&](std::size_t offset, std::size_t size) {
      covered.insert(covered.end(), message.begin() + static_cast<std::ptrdiff_t>(offset),
                     message.begin() + static_cast<std::ptrdiff_t>(offset + size));
    };
    cover(0, kFingerprint + 3 * sizeof(std::int64_t));
    std::size_t slices = covered.size() + EncodedSize<candidate_plan_t>() - kFingerprint;
    for (int bound = 0; bound < 2; ++bound, slices += kAllSlices * kRow)
      for (std::size_t t = 0; t <= static_cast<std::size_t>(steps); ++t)
        cover(slices + t * kRow, static_cast<std::size_t>(states) * sizeof(double));
    cover(slices, static_cast<std::size_t>(states) * sizeof(double));
    cover(slices + kRow, sizeof(std::int64_t) + 7 * sizeof(Digest));
    EXPECT_EQ(CertificateDigest(certified), DigestOf(covered));
    EXPECT_EQ(covered.size(), 264u + 8u * static_cast<unsigned>(states + 2 * states * (steps + 1)));
  }
}

// Fast for good: other implementations have to come to the same.
TEST(Seal, DigestOfAnExampleIsTheRecordedOne) {
  EXPECT_EQ(ToHex(CertificateDigest(Plan(6, 12))), "5c328cfd05dfad8ea0da3d8809d788b1524452c5e51970e085c7ed46c626fa94");
}

// Of a small plan each byte, of the largest one in eight at random.
TEST(Seal, BreaksWhenAnyBitIsFlipped) {
  FreshRandom random;
  for (const auto& [states, steps, stride] : {std::tuple(6, 12, 1), {16, 128, 8}}) {
    const std::vector<std::uint8_t> good = Encode(Plan(states, steps));
    std::vector<std::uint8_t> bad = good;
    for (std::size_t i = kFingerprint; i < good.size(); i += 1 + random() % (2 * stride - 1)) {
      bad[i] ^= static_cast<std::uint8_t>(1u << random() % 8);
      const auto certified = Decoded<certified_plan_t>(bad).value();
      ASSERT_FALSE(FindSealFaults(certified).empty()) << "byte " << i << " of " << states << " states";
      bad[i] = good[i];
    }
  }
}

TEST(Seal, BreaksWhenASliceInUseChangesByOneUlp) {
  const auto nudge = [](double& x) { x = std::nextafter(x, 0); };
  EXPECT_THAT(FaultsAfter([&](auto& c) { nudge(c.slice_upper[12][5]); }), ElementsAre(Kind::kCertificateDigest));
  EXPECT_THAT(FaultsAfter([&](auto& c) { nudge(c.slice_lower[0][0]); }), ElementsAre(Kind::kCertificateDigest));
}

TEST(Seal, BreaksWhenWhatTheGuardUpholdsChanges) {
  EXPECT_THAT(FaultsAfter([](auto& c) { c.state_error[5] = std::nextafter(c.state_error[5], 0); }),
              ElementsAre(Kind::kCertificateDigest));
  for (const std::int64_t other : {-1, 2999, 3001})
    EXPECT_THAT(FaultsAfter([&](auto& c) { c.step_error_us = other; }), ElementsAre(Kind::kCertificateDigest)) << other;
}

TEST(Seal, BreaksWhenAnUnusedEntryIsNotZero) {
  for (const double stray :
       {1.0, -0.0, std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THAT(FaultsAfter([&](auto& c) { c.slice_lower[12][6] = stray; }), ElementsAre(Kind::kUnusedEntry)) << stray;
    EXPECT_THAT(FaultsAfter([&](auto& c) { c.slice_upper[13][0] = stray; }), ElementsAre(Kind::kUnusedEntry)) << stray;
    EXPECT_THAT(FaultsAfter([&](auto& c) { c.slice_upper[128][15] = stray; }), ElementsAre(Kind::kUnusedEntry))
        << stray;
    EXPECT_THAT(FaultsAfter([&](auto& c) { c.state_error[6] = stray; }), ElementsAre(Kind::kUnusedEntry)) << stray;
  }
}

TEST(Seal, TheFirstStrayEntryIsNamed) {
  certified_plan_t certified = Plan(6, 12);
  certified.slice_upper[3][7] = 2;
  certified.slice_lower[40][3] = 1e-300;
  Seal(certified);  // no digest covers it
  const std::vector<SealFault> faults = FindSealFaults(certified);
  EXPECT_FIELDS(Only(faults), (field, "slice_lower[40][3]"), (step, 40), (coordinate, 3), (value, 1e-300),
                (found, "1e-300"));
}

TEST(Seal, BreaksWhenThePlanChanges) {
  EXPECT_THAT(FaultsAfter([](auto& c) { c.plan.control[4][0] = 1; }), ElementsAre(Kind::kPlanDigest));
  EXPECT_THAT(FaultsAfter([](auto& c) { c.plan.control[100][7] = 1; }), ElementsAre(Kind::kPlanDigest)) << "unused";
  const auto with_its_digest = [](auto& c) {
    c.plan.control[4][0] = 1;
    SetDigest(c.plan_digest, PlanDigest(c.plan));
  };
  EXPECT_THAT(FaultsAfter(with_its_digest), ElementsAre(Kind::kCertificateDigest));
}

TEST(Seal, BreaksWhenATimeOrADigestChanges) {
  EXPECT_THAT(FaultsAfter([](auto& c) { ++c.utime; }), ElementsAre(Kind::kCertificateDigest));
  EXPECT_THAT(FaultsAfter([](auto& c) { ++c.sequence; }), ElementsAre(Kind::kCertificateDigest));
  EXPECT_THAT(FaultsAfter([](auto& c) { ++c.expires_utime; }), ElementsAre(Kind::kCertificateDigest));
  EXPECT_THAT(FaultsAfter([](auto& c) { std::swap(c.config_digest, c.model_digest); }),
              ElementsAre(Kind::kCertificateDigest));
  EXPECT_THAT(FaultsAfter([](auto& c) { c.transitions_digest[31] ^= 1; }), ElementsAre(Kind::kCertificateDigest));
  EXPECT_THAT(FaultsAfter([](auto& c) { SetDigest(c.transitions_digest, {}); }), ElementsAre(Kind::kCertificateDigest));
}

// Fewer slices in use, or the same numbers as more slices of fewer states: the plan says otherwise.
TEST(Seal, BreaksWhenTheCountsChange) {
  const auto with = [](int states, int steps) {
    return FaultsAfter([=](certified_plan_t& c) {
      c.plan.num_states = static_cast<std::int16_t>(states);
      c.plan.num_steps = static_cast<std::int16_t>(steps);
      SetDigest(c.certificate_digest, CertificateDigest(c));
    });
  };
  EXPECT_THAT(with(6, 11), ElementsAre(Kind::kPlanDigest, Kind::kUnusedEntry));
  EXPECT_THAT(with(6, 13), ElementsAre(Kind::kPlanDigest));
  for (const auto& [states, steps] : {std::pair(0, 12), {-1, 12}, {17, 12}, {32767, 12}, {6, 0}, {6, -5}, {6, 129}})
    EXPECT_THAT(with(states, steps), ElementsAre(Kind::kPlanDigest, Kind::kUnusedEntry)) << states << " " << steps;
}

}  // namespace forereach::seal_test
