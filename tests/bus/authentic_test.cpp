// Signed messages: which are refused, and that only the message, its role and its freshness decide.
#include "bus/authentic.h"

#include "tests/test.h"

#include "bus/authentic_bus.h"
#include "tests/keys.h"

namespace forereach::authentic_test {

constexpr std::int64_t kBegun = 1'000'000;
constexpr std::int64_t kClock = kBegun + 1000;  // of the receiver
constexpr std::int64_t kHour = 3'600'000'000;
const std::string kBus = "bus";
const std::vector<std::uint8_t> kMessage{10, 20, 30};
// One channel of each role, named after it.
const Speakers kSpeakers = [] {
  Speakers speakers;
  for (const Role role : kAllRoles) speakers.emplace(RoleName(role), role);
  return speakers;
}();

Authenticator Receiver(const KeyRing& keys = TestKeys()) { return {keys, kBus, kSpeakers, kBegun}; }

std::vector<std::uint8_t> Signed(std::int64_t now = kBegun + 1, const KeyRing& keys = TestKeys()) {
  return Signer(keys, kBus, 1).Sign(Role::kCertifier, "certifier", kMessage, now);
}

Authenticity Judge(const std::vector<std::uint8_t>& bytes, const std::string& channel = "certifier",
                   const KeyRing& keys = TestKeys()) {
  return Receiver(keys).Check(channel, bytes, kClock).first;
}

TEST(Authentic, TheMessageComesOutAsItWas) {
  const std::vector<std::uint8_t> bytes = Signed();
  EXPECT_EQ(bytes.size(), kMessage.size() + kTrailerBytes);
  EXPECT_EQ(kTrailerBytes, 112u);
  Authenticator authenticator = Receiver();
  const auto [authenticity, message] = authenticator.Check("certifier", bytes, kClock);
  EXPECT_EQ(authenticity, Authenticity::kAuthentic);
  EXPECT_TRUE(std::ranges::equal(message, kMessage));
  EXPECT_TRUE(std::ranges::equal(WithoutSignature(bytes), kMessage));
  EXPECT_TRUE(std::ranges::equal(WithoutSignature(kMessage), kMessage));
}

// The trailer as docs/bus.md has it: somebody else's program can be written by that page.
TEST(Authentic, TheTrailerIsAsItIsWrittenDown) {
  const std::vector<std::uint8_t> bytes = Signed(kBegun + 1);
  const Bytes trailer = Bytes(bytes).subspan(kMessage.size());
  const Digest bus = DigestOf(kBus);
  EXPECT_TRUE(std::ranges::equal(trailer.first(8), Bytes(bus).first(8)));
  EXPECT_EQ(FromBigEndian<std::uint64_t>(trailer.subspan(8)), 1u);
  EXPECT_EQ(FromBigEndian<std::int64_t>(trailer.subspan(16)), kBegun + 1);
  EXPECT_EQ(std::string(trailer.end() - 8, trailer.end()), "FRSIGN02");
  std::vector<std::uint8_t> covered, text;
  const auto append = [](std::vector<std::uint8_t>& to, const auto& part) {
    to.insert(to.end(), part.begin(), part.end());
  };
  append(text, BigEndian<std::uint64_t>(9));
  append(text, std::string("certifier"));
  append(text, kMessage);
  append(covered, std::string("ForeReach message 2"));
  append(covered, DigestOf("test"));
  covered.push_back(1);
  append(covered, trailer.first(24));
  append(covered, DigestOf(text));
  Signature signature;
  std::copy_n(trailer.begin() + 24, signature.size(), signature.begin());
  EXPECT_TRUE(TestKeys().IsSigned(Role::kCertifier, covered, signature));
  std::vector<std::uint8_t> tagged;
  append(tagged, std::string("ForeReach trailer 2"));
  append(tagged, BigEndian<std::uint64_t>(9));
  append(tagged, std::string("certifier"));
  append(tagged, BigEndian<std::uint64_t>(kMessage.size()));
  append(tagged, trailer.first(24 + 64));
  EXPECT_TRUE(std::ranges::equal(TestKeys().Tag(tagged), trailer.subspan(24 + 64, 16)));
}

TEST(Authentic, RefusesAMessageWithAnyBitFlipped) {
  const std::vector<std::uint8_t> bytes = Signed();
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    std::vector<std::uint8_t> altered = bytes;
    altered[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    EXPECT_NE(Judge(altered), Authenticity::kAuthentic) << bit;
  }
}

TEST(Authentic, EveryOtherLengthIsRefused) {
  const std::vector<std::uint8_t> bytes = Signed();
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_EQ(Judge({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}), Authenticity::kUnsigned)
        << size;
  std::vector<std::uint8_t> longer = bytes;
  longer.insert(longer.begin(), 0);
  EXPECT_EQ(Judge(longer), Authenticity::kForged);
  const std::vector<std::uint8_t> shorter(bytes.begin() + 1, bytes.end());
  EXPECT_EQ(Judge(shorter), Authenticity::kForged);
}

TEST(Authentic, EachChannelIsOneRolesAlone) {
  for (const Role speaker : kAllRoles)
    for (const auto& [channel, role] : kSpeakers)
      EXPECT_EQ(Judge(Signer(TestKeys(), kBus).Sign(speaker, channel, kMessage, kBegun + 1), channel),
                speaker == role ? Authenticity::kAuthentic : Authenticity::kForged)
          << RoleName(speaker) << " on " << channel;
}

TEST(Authentic, HoldsForItsChannelItsRobotAndItsBus) {
  EXPECT_EQ(Judge(Signed(), "planner"), Authenticity::kForged);
  EXPECT_EQ(Judge(Signed(), "nobody's"), Authenticity::kForged);
  EXPECT_EQ(Judge(Signed(kBegun + 1, TestKeys("other"))), Authenticity::kForged);
  EXPECT_EQ(Judge(Signed(kBegun + 1, MakeKeyRing("test", DigestOf("other entropy")))), Authenticity::kForged);
  EXPECT_EQ(Judge(kMessage), Authenticity::kUnsigned);
  const auto of_other_bus =
      Signer(TestKeys(), "other bus", 1).Sign(Role::kCertifier, "certifier", kMessage, kBegun + 1);
  EXPECT_EQ(Judge(of_other_bus), Authenticity::kForeign);
  Authenticator authenticator = Receiver();
  EXPECT_EQ(authenticator.Check("certifier", of_other_bus, kClock).first, Authenticity::kForeign);
  EXPECT_EQ(authenticator.Check("certifier", Signed(), kClock).first, Authenticity::kAuthentic)
      << "its counter is not used up";
}

TEST(Authentic, ANameThatIsNotTheRobotsDoesNotPassWithItsKeys) {
  // The same secrets under another name: what is signed names the robot.
  const Digest entropy = DigestOf("one for two");
  EXPECT_EQ(Judge(Signed(kBegun + 1, MakeKeyRing("alpha", entropy)), "certifier", MakeKeyRing("beta", entropy)),
            Authenticity::kForged);
}

TEST(Authentic, ACounterIsTakenOnce) {
  Signer signer(TestKeys(), kBus, 1), other(TestKeys(), kBus, 2);
  const auto sign = [](Signer& by, std::int64_t now) { return by.Sign(Role::kCertifier, "certifier", kMessage, now); };
  const auto first = sign(signer, kBegun + 1), second = sign(signer, kBegun + 1);
  Authenticator authenticator = Receiver();
  const auto judge = [&](const std::vector<std::uint8_t>& bytes) {
    return authenticator.Check("certifier", bytes, kClock).first;
  };
  EXPECT_EQ(judge(second), Authenticity::kAuthentic);
  EXPECT_EQ(judge(second), Authenticity::kReplayed);
  EXPECT_EQ(judge(first), Authenticity::kReplayed) << "older ones are not fresh any more";
  const auto third = sign(signer, kBegun + 2);
  EXPECT_EQ(judge(third), Authenticity::kAuthentic);
  EXPECT_EQ(judge(third), Authenticity::kReplayed) << "nor is a later one, once it was taken";
  EXPECT_EQ(judge(sign(other, kBegun + 1)), Authenticity::kAuthentic) << "each sender for itself";
  EXPECT_EQ(judge(sign(signer, kBegun + 3 - Signer::kSetBackUs)), Authenticity::kAuthentic)
      << "a clock set back a little does not stop it";
  EXPECT_EQ(authenticator.refusals().replayed, 3);
}

TEST(Authentic, RefusesMessagesFromBeforeTheReceiverBegan) {
  EXPECT_EQ(Judge(Signed(kBegun)), Authenticity::kOld);
  EXPECT_EQ(Judge(Signed(kBegun + 1)), Authenticity::kAuthentic);
  EXPECT_EQ(Judge(Signed(-kHour)), Authenticity::kOld);
}

TEST(Authentic, NothingFromAheadOfTheReceiversClock) {
  EXPECT_EQ(Judge(Signed(kClock + kClockErrorUs)), Authenticity::kAuthentic);
  EXPECT_EQ(Judge(Signed(kClock + kClockErrorUs + 1)), Authenticity::kAhead);
  EXPECT_EQ(Judge(Signed(std::numeric_limits<std::int64_t>::max())), Authenticity::kAhead);
  Authenticator lenient(TestKeys(), kBus, {{"certifier", {Role::kCertifier, kHour}}}, kBegun);
  EXPECT_EQ(lenient.Check("certifier", Signed(kClock + kHour + 1), kClock).first, Authenticity::kAhead);
  EXPECT_EQ(lenient.Check("certifier", Signed(kClock + kHour), kClock).first, Authenticity::kAuthentic)
      << "a channel may allow more";
  EXPECT_FIELDS(lenient.refusals(), (ahead, 1), (all(), 1));
}

TEST(Authentic, RefusalsAreCountedByTheRoleOfTheirChannelAndItsClockIsNamed) {
  constexpr std::int64_t kTenMinutes = 600'000'000;
  Authenticator authenticator = Receiver();
  EXPECT_EQ(DescribeClocks(authenticator.refusals(), {}), "");
  EXPECT_EQ(authenticator.Check("certifier", Signed(kClock + kTenMinutes), kClock).first, Authenticity::kAhead);
  EXPECT_EQ(authenticator.Check("certifier", kMessage, kClock).first, Authenticity::kUnsigned);
  EXPECT_EQ(authenticator.Check("nobody's", Signed(), kClock).first, Authenticity::kForged);
  const Refusals before = authenticator.refusals();
  EXPECT_EQ(before.all(), 3);
  ASSERT_EQ(before.by_role.size(), 1u);
  EXPECT_FIELDS(before.by_role.at(Role::kCertifier), (counts.all(), 2), (counts.ahead, 1), (apart_us, kTenMinutes));
  EXPECT_EQ(DescribeClocks(before, {}), "certifier's messages are signed 600 s ahead of the clock here");
  EXPECT_EQ(DescribeClocks(before, before), "") << "none since";
  EXPECT_EQ(authenticator.Check("certifier", Signed(kClock - kTenMinutes), kClock).first, Authenticity::kOld);
  EXPECT_EQ(DescribeClocks(authenticator.refusals(), before),
            "certifier's messages are signed 600 s before the clock here, and before this start");
  EXPECT_EQ(authenticator.Check("certifier", Signed(std::numeric_limits<std::int64_t>::max()), kClock).first,
            Authenticity::kAhead);
  Refusals sum;
  sum += authenticator.refusals();
  sum += before;
  EXPECT_EQ(sum.all(), 8);
  EXPECT_EQ(sum.by_role.at(Role::kCertifier).counts.ahead, 3);
}

// Somebody keeps what was signed while a clock was ahead, for a receiver that starts later.
TEST(Authentic, WhatWasSignedWhileAClockWasAheadCountsForNoReceiverThatStartsAfterwards) {
  const auto kept = Signed(kBegun + kHour);
  for (const std::int64_t start : {kBegun, kBegun + kHour / 2, kBegun + kHour - kClockErrorUs - 1}) {
    Authenticator receiver(TestKeys(), kBus, kSpeakers, start);
    EXPECT_EQ(receiver.Check("certifier", kept, start).first, Authenticity::kAhead);
  }
  Authenticator receiver(TestKeys(), kBus, kSpeakers, kBegun + kHour);
  EXPECT_EQ(receiver.Check("certifier", kept, kBegun + kHour).first, Authenticity::kOld);
}

TEST(Authentic, WithoutAStartTheFirstMessageTellsIt) {
  const auto receiver = [] { return Authenticator(TestKeys(), kBus, kSpeakers, std::nullopt); };
  EXPECT_EQ(receiver().Check("certifier", Signed(kHour - kClockErrorUs), kHour).first, Authenticity::kOld);
  EXPECT_EQ(receiver().Check("certifier", Signed(kHour - kClockErrorUs + 1), kHour).first, Authenticity::kAuthentic)
      << "clocks may differ by so much";
  Authenticator later = receiver();
  EXPECT_EQ(later.Check("certifier", kMessage, kHour).first, Authenticity::kUnsigned);
  EXPECT_EQ(later.Check("certifier", Signed(kHour - kClockErrorUs), kHour + kClockErrorUs).first, Authenticity::kOld)
      << "the first of any kind";
}

TEST(Authentic, ASenderWhoseClockIsSetBackGoesOnAsAnother) {
  Signer signer(TestKeys(), kBus, 1);
  const auto sign = [&](std::int64_t now) { return signer.Sign(Role::kCertifier, "certifier", kMessage, now); };
  Authenticator authenticator = Receiver();
  EXPECT_EQ(SenderOf(sign(kClock)), 1u);
  const auto ahead = sign(kClock + kHour);
  EXPECT_EQ(SenderOf(ahead), 1u);
  EXPECT_EQ(authenticator.Check("certifier", ahead, kClock).first, Authenticity::kAhead);
  EXPECT_EQ(SenderOf(sign(kClock + kHour - Signer::kSetBackUs)), 1u);
  const auto right_again = sign(kClock);
  EXPECT_NE(SenderOf(right_again), 1u);
  EXPECT_EQ(SenderOf(sign(kClock + 1)), SenderOf(right_again));
  EXPECT_EQ(authenticator.Check("certifier", right_again, kClock).first, Authenticity::kAuthentic);
}

TEST(Authentic, AReceiverWhoseClockIsSetBackTakesThatForItsStart) {
  Authenticator authenticator = Receiver();
  Signer signer(TestKeys(), kBus, 1);
  const auto judge = [&](std::int64_t now) {
    return authenticator.Check("certifier", signer.Sign(Role::kCertifier, "certifier", kMessage, now), now).first;
  };
  EXPECT_EQ(judge(kBegun + 1), Authenticity::kAuthentic);
  EXPECT_EQ(judge(kBegun - kHour), Authenticity::kAuthentic) << "all clocks were set back";
  EXPECT_EQ(judge(kBegun - kHour + 1), Authenticity::kAuthentic);
  const auto earlier =
      Signer(TestKeys(), kBus, 2).Sign(Role::kCertifier, "certifier", kMessage, kBegun - kHour - kClockErrorUs);
  EXPECT_EQ(authenticator.Check("certifier", earlier, kBegun - kHour + 2).first, Authenticity::kOld);
}

TEST(Authentic, TheSenderIsInTheTrailer) {
  EXPECT_EQ(SenderOf(Signed()), 1u);
  EXPECT_EQ(SenderOf(kMessage), std::nullopt);
}

TEST(Authentic, RefusalsAreSaidByTheirCause) {
  EXPECT_EQ(DescribeRefusals({}), "");
  EXPECT_EQ(DescribeRefusals({.unsigned_ones = 1, .forged = 2, .replayed = 3}), "6 (unsigned 1, forged 2, replayed 3)");
  EXPECT_EQ(DescribeRefusals({.foreign = 1, .old = 2, .ahead = 3}),
            "6 (unsigned 0, forged 0, replayed 0, signed before the start 2, signed ahead of the clock 3, of another "
            "bus 1)");
}

TEST(Authentic, AnAlteredBodyDoesNotUseTheCounterUp) {
  Authenticator authenticator = Receiver();
  const auto bytes = Signed();
  auto altered = bytes;
  altered[0] ^= 1;
  for (int i = 0; i + 1 < Authenticator::kMaxTries; ++i)
    EXPECT_EQ(authenticator.Check("certifier", altered, kClock).first, Authenticity::kForged);
  EXPECT_EQ(authenticator.Check("certifier", bytes, kClock).first, Authenticity::kAuthentic);
}

// Each such try costs an Ed25519: behind one trailer they end.
TEST(Authentic, ATrailerUnderManyAlteredBodiesIsRefusedAndNoOther) {
  Signer signer(TestKeys(), kBus, 1);
  const auto sign = [&] { return signer.Sign(Role::kCertifier, "certifier", kMessage, kBegun + 1); };
  Authenticator authenticator = Receiver();
  const auto lost = sign(), next = sign();
  auto altered = lost;
  altered[0] ^= 1;
  for (int i = 0; i < Authenticator::kMaxTries; ++i)
    EXPECT_EQ(authenticator.Check("certifier", altered, kClock).first, Authenticity::kForged);
  EXPECT_EQ(authenticator.Check("certifier", lost, kClock).first, Authenticity::kForged);
  EXPECT_EQ(authenticator.Check("certifier", next, kClock).first, Authenticity::kAuthentic);
}

TEST(Authentic, RefusesAReplayOfASenderThatItHasForgotten) {
  Authenticator authenticator = Receiver();
  std::vector<std::vector<std::uint8_t>> sent;
  for (std::size_t i = 0; i < 3 * Authenticator::kMaxSenders; ++i) {
    sent.push_back(Signer(TestKeys(), kBus, i)
                       .Sign(Role::kPlanner, "planner", kMessage, kBegun + 1 + static_cast<std::int64_t>(i)));
    EXPECT_EQ(authenticator.Check("planner", sent.back(), kClock).first, Authenticity::kAuthentic) << i;
  }
  for (const auto& bytes : sent)
    EXPECT_EQ(authenticator.Check("planner", bytes, kClock).first, Authenticity::kReplayed);
}

// Sixteen starts of a process, then all clocks are set back.
TEST(Authentic, AClockSetBackRefusesNoNewSenderUnlessTheMemoryIsFull) {
  for (const std::size_t senders : {std::size_t{16}, Authenticator::kMaxSenders - 1, Authenticator::kMaxSenders}) {
    Authenticator authenticator = Receiver();
    const auto judge = [&](std::uint64_t id, std::int64_t now) {
      return authenticator
          .Check("planner", Signer(TestKeys(), kBus, id).Sign(Role::kPlanner, "planner", kMessage, now), now)
          .first;
    };
    for (std::size_t id = 0; id < senders; ++id) ASSERT_EQ(judge(id, kClock + kHour), Authenticity::kAuthentic);
    const bool has_room = senders < Authenticator::kMaxSenders;
    EXPECT_EQ(judge(1000, kClock), has_room ? Authenticity::kAuthentic : Authenticity::kReplayed) << senders;
  }
}

// Who holds the planner's secret and the group key can lock out planners. Nobody else's counters are touched.
TEST(Authentic, AStolenKeyCannotUseUpCountersOfAnotherRole) {
  const KeyRing stolen = TestKeys();  // of which the thief uses the planner's secret only
  Authenticator authenticator = Receiver();
  Signer certifier(TestKeys(), kBus, 1);
  const auto certified = [&] {
    return authenticator.Check("certifier", certifier.Sign(Role::kCertifier, "certifier", kMessage, kBegun + 1), kClock)
        .first;
  };
  EXPECT_EQ(certified(), Authenticity::kAuthentic);
  for (std::uint64_t sender = 0; sender < 4 * Authenticator::kMaxSenders; ++sender) {
    EXPECT_EQ(authenticator
                  .Check("planner",
                         Signer(stolen, kBus, sender)
                             .Sign(Role::kPlanner, "planner", kMessage, kClock + static_cast<std::int64_t>(sender)),
                         kClock)
                  .first,
              Authenticity::kAuthentic);
    EXPECT_EQ(authenticator
                  .Check("certifier", Signer(stolen, kBus, sender).Sign(Role::kPlanner, "certifier", kMessage, kClock),
                         kClock)
                  .first,
              Authenticity::kForged);
  }
  EXPECT_EQ(certified(), Authenticity::kAuthentic) << "its own sender number was among those";
  EXPECT_EQ(authenticator
                .Check("certifier",
                       Signer(TestKeys(), kBus, 999).Sign(Role::kCertifier, "certifier", kMessage, kBegun + 2), kClock)
                .first,
            Authenticity::kAuthentic)
      << "one that has just started";
}

TEST(Authentic, PublicKeysAreEnoughToJudgeALog) {
  const ScratchDirectory scratch;
  const std::string path = MakeTestKeys(scratch / "keys");
  const KeyRing all = LoadAllKeys(path), open = LoadPublicKeys(path + "/verify.pub");
  EXPECT_FALSE(open.HoldsGroup());
  const auto bytes = Signed(kBegun + 1, all);
  Authenticator authenticator(open, std::nullopt, kSpeakers, kBegun);
  auto altered = bytes;
  altered[0] ^= 1;
  EXPECT_EQ(authenticator.Check("certifier", altered, kClock).first, Authenticity::kForged);
  EXPECT_EQ(authenticator.Check("certifier", bytes, kClock).first, Authenticity::kAuthentic);
  EXPECT_EQ(authenticator.Check("certifier", bytes, kClock).first, Authenticity::kReplayed);
  const auto foreign = Signer(all, "other bus").Sign(Role::kCertifier, "certifier", kMessage, kBegun + 2);
  EXPECT_EQ(authenticator.Check("certifier", foreign, kClock).first, Authenticity::kForeign)
      << "the first one's bus counts";
  EXPECT_THROW((void)Signer(open, kBus).Sign(Role::kCertifier, "certifier", kMessage, 1), std::logic_error);
}

TEST(Authentic, RandomBytesNeverPass) {
  FreshRandom random;
  const std::vector<std::uint8_t> bytes = Signed();
  for (int i = 0; i < 5'000; ++i) {
    std::vector<std::uint8_t> altered = bytes;
    for (unsigned changes = 1 + random() % 4; changes > 0; --changes)
      altered[random() % (altered.size() - 8)] = static_cast<std::uint8_t>(random());
    ASSERT_EQ(Judge(altered) == Authenticity::kAuthentic, altered == bytes);
  }
}

TEST(SignedBus, ProtectsItsChannelsAndNoOthers) {
  std::int64_t now = kBegun;
  const auto clock = [&] { return now++; };
  const auto bus = OpenSignedBus("memq://", TestKeys(), kBus, {{"SIGNED", Role::kPlanner}}, clock);
  int on_signed = 0, again = 0, on_other = 0;
  std::vector<std::vector<std::uint8_t>> unchecked;
  bus->Subscribe("SIGNED", [&](const Received& r) { on_signed += std::ranges::equal(r.bytes, kMessage); });
  bus->Subscribe("SIGNED", [&](const Received& r) { again += std::ranges::equal(r.bytes, kMessage); });
  bus->Subscribe("OTHER", [&](const Received&) { ++on_other; });
  bus->SubscribeUnchecked("SIGNED", [&](const Received& r) { unchecked.emplace_back(r.raw.begin(), r.raw.end()); });
  bus->Publish("SIGNED", Bytes(kMessage));
  bus->Publish("OTHER", Bytes(kMessage));
  bus->Dispatch(0);
  EXPECT_EQ(on_signed, 1);
  EXPECT_EQ(again, 1) << "each subscription gets it once";
  EXPECT_EQ(on_other, 1);
  EXPECT_EQ(Only(unchecked).size(), kMessage.size() + kTrailerBytes);
  EXPECT_EQ(bus->refusals().all(), 0);
}

TEST(SignedBus, DoesNotSpeakAsAnotherRole) {
  const ScratchDirectory scratch;
  const KeyRing planner = LoadKeys(MakeTestKeys(scratch / "keys"), Role::kPlanner);
  const auto bus = OpenSignedBus("memq://", planner, kBus, kSpeakers);
  EXPECT_TRUE(bus->Publish("planner", Bytes(kMessage)));
  EXPECT_FALSE(bus->Publish("certifier", Bytes(kMessage)));
  EXPECT_TRUE(bus->Publish("nobody's", Bytes(kMessage)));
}

}  // namespace forereach::authentic_test
