// Signed messages: what is refused, and that nothing but the message and its freshness decides.
#include "lcmtypes/authentic.h"

#include <fstream>
#include <random>

#include <sys/stat.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lcmtypes/authentic_bus.h"
#include "tests/scratch.h"

namespace forereach {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kBegun = 1'000'000;
const Key256 kKey{1, 2, 3}, kOther{1, 2, 4};
const std::vector<std::uint8_t> kMessage{10, 20, 30};

std::vector<std::uint8_t> Signed(std::int64_t now = kBegun + 1) {
  return Signer(kKey, "test", 0).Sign("CHANNEL", kMessage, now);
}

Authenticity Judge(const std::vector<std::uint8_t>& bytes, const std::string& channel = "CHANNEL", const Key256& key = kKey) {
  return Authenticator(key, kBegun).Check(channel, bytes).first;
}

TEST(Authentic, TheMessageComesOutAsItWas) {
  const std::vector<std::uint8_t> bytes = Signed();
  EXPECT_EQ(bytes.size(), kMessage.size() + kSignatureBytes);
  Authenticator authenticator(kKey, kBegun);
  const auto [authenticity, message] = authenticator.Check("CHANNEL", bytes);
  EXPECT_EQ(authenticity, Authenticity::kAuthentic);
  EXPECT_TRUE(std::ranges::equal(message, kMessage));
  EXPECT_TRUE(std::ranges::equal(WithoutSignature(bytes), kMessage));
  EXPECT_TRUE(std::ranges::equal(WithoutSignature(kMessage), kMessage));
}

TEST(Authentic, EveryBitCounts) {
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
    EXPECT_EQ(Judge({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}), Authenticity::kUnsigned) << size;
  std::vector<std::uint8_t> longer = bytes;
  longer.insert(longer.begin(), 0);
  EXPECT_EQ(Judge(longer), Authenticity::kForged);
}

TEST(Authentic, HoldsForItsChannelAndItsKey) {
  EXPECT_EQ(Judge(Signed(), "CHANNE"), Authenticity::kForged);
  EXPECT_EQ(Judge(Signed(), "CHANNEL", kOther), Authenticity::kForged);
  EXPECT_EQ(Judge(kMessage), Authenticity::kUnsigned);
}

TEST(Authentic, ACounterIsTakenOnce) {
  Signer signer(kKey, "test", 0), other(kKey, "other", 0);
  const auto first = signer.Sign("CHANNEL", kMessage, kBegun + 1), second = signer.Sign("CHANNEL", kMessage, kBegun + 1);
  Authenticator authenticator(kKey, kBegun);
  const auto judge = [&](const std::vector<std::uint8_t>& bytes) { return authenticator.Check("CHANNEL", bytes).first; };
  EXPECT_EQ(judge(second), Authenticity::kAuthentic);
  EXPECT_EQ(judge(second), Authenticity::kReplayed);
  EXPECT_EQ(judge(first), Authenticity::kReplayed) << "older ones are not fresh any more";
  EXPECT_EQ(judge(other.Sign("CHANNEL", kMessage, kBegun + 1)), Authenticity::kAuthentic) << "each sender for itself";
  EXPECT_EQ(judge(signer.Sign("CHANNEL", kMessage, 0)), Authenticity::kAuthentic) << "a clock set back does not stop it";
  EXPECT_EQ(authenticator.refusals().replayed, 2);
}

TEST(Authentic, NothingFromBeforeTheReceiverBegan) {
  EXPECT_EQ(Judge(Signed(kBegun)), Authenticity::kReplayed);
  EXPECT_EQ(Judge(Signed(kBegun + 1)), Authenticity::kAuthentic);
}

TEST(Authentic, WhatIsForgottenIsNotTakenASecondTime) {
  Authenticator authenticator(kKey, kBegun);
  std::vector<std::vector<std::uint8_t>> sent;
  for (std::size_t i = 0; i < 3 * Authenticator::kMaxStreams; ++i) {
    sent.push_back(Signer(kKey, "sender " + std::to_string(i), 0)
                       .Sign("CHANNEL", kMessage, kBegun + 1 + static_cast<std::int64_t>(i)));
    EXPECT_EQ(authenticator.Check("CHANNEL", sent.back()).first, Authenticity::kAuthentic) << i;
  }
  for (const auto& bytes : sent) EXPECT_EQ(authenticator.Check("CHANNEL", bytes).first, Authenticity::kReplayed);
}

TEST(Authentic, RandomBytesNeverPass) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::vector<std::uint8_t> bytes = Signed();
  for (int i = 0; i < 20'000; ++i) {
    std::vector<std::uint8_t> altered = bytes;
    for (unsigned changes = 1 + random() % 4; changes > 0; --changes)
      altered[random() % (altered.size() - 8)] = static_cast<std::uint8_t>(random());
    ASSERT_EQ(Judge(altered) == Authenticity::kAuthentic, altered == bytes);
  }
}

class KeyFile : public testing::Test {
 protected:
  std::string Problem() const {
    try {
      static_cast<void>(LoadKey(path_));
      return "";
    } catch (const KeyError& error) {
      return error.what();
    }
  }
  const ScratchDirectory scratch_;
  const std::string path_ = scratch_ / "key";
};

TEST_F(KeyFile, IsMadeForItsOwnerAloneAndIsNeverReplaced) {
  MakeKeyFile(path_);
  struct stat status {};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  const Key256 key = LoadKey(path_);
  EXPECT_NE(key, Key256{});
  EXPECT_THROW(MakeKeyFile(path_), KeyError);
  EXPECT_EQ(LoadKey(path_), key);
}

TEST_F(KeyFile, ThatOthersCanReadIsRefused) {
  MakeKeyFile(path_);
  for (const mode_t mode : {0640, 0604, 0620, 0602}) {
    ::chmod(path_.c_str(), mode);
    EXPECT_THAT(Problem(), HasSubstr("chmod 600")) << std::oct << mode;
  }
  ::chmod(path_.c_str(), 0400);
  EXPECT_EQ(Problem(), "");
}

TEST_F(KeyFile, ThatHoldsNoKeyIsRefused) {
  EXPECT_THAT(Problem(), HasSubstr("cannot be read"));
  MakeKeyFile(path_);
  std::string text;
  std::getline(std::ifstream(path_), text);
  std::string no_hex = text;
  no_hex.back() = 'g';
  for (const std::string& bad : {std::string(), text, text + "0\n", text + "0", text.substr(1) + "\n", no_hex + "\n"}) {
    std::ofstream(path_, std::ios::trunc) << bad;
    EXPECT_THAT(Problem(), HasSubstr("holds no key")) << bad;
  }
}

TEST(AuthenticBusTest, ProtectsItsChannelsAndNoOthers) {
  std::int64_t now = kBegun;
  const auto clock = [&] { return now++; };
  auto inner = OpenBus("memq://", clock);
  Bus& raw = *inner;
  const auto bus = Authenticate(std::move(inner), kKey, "test", {"SIGNED"}, clock);
  int on_signed = 0, again = 0, on_other = 0;
  std::vector<std::uint8_t> unchecked;
  bus->Subscribe("SIGNED", [&](const Received& r) { on_signed += std::ranges::equal(r.bytes, kMessage); });
  bus->Subscribe("SIGNED", [&](const Received& r) { again += std::ranges::equal(r.bytes, kMessage); });
  bus->Subscribe("OTHER", [&](const Received&) { ++on_other; });
  bus->SubscribeUnchecked("SIGNED", [&](const Received& r) { unchecked.assign(r.bytes.begin(), r.bytes.end()); });
  bus->Publish("SIGNED", Bytes(kMessage));
  bus->Dispatch(0);
  EXPECT_EQ(on_signed, 1);
  EXPECT_EQ(again, 1) << "each subscription gets it once";
  EXPECT_EQ(unchecked.size(), kMessage.size() + kSignatureBytes);
  const auto replayed = unchecked;
  raw.Publish("SIGNED", Bytes(kMessage));
  raw.Publish("SIGNED", Bytes(replayed));
  raw.Publish("SIGNED", Bytes(Signer(kOther, "test", 0).Sign("SIGNED", kMessage, now + 100)));
  bus->Publish("OTHER", Bytes(kMessage));
  bus->Dispatch(0);
  EXPECT_EQ(on_signed, 1);
  EXPECT_EQ(on_other, 1);
  EXPECT_EQ(bus->refusals().unsigned_ones, 2) << "of both subscriptions";
  EXPECT_EQ(bus->refusals().replayed, 2);
  EXPECT_EQ(bus->refusals().forged, 2);
}

}  // namespace
}  // namespace forereach
