
#include "tests/messages.h"
#include "tests/test.h"

namespace forereach::codec_test {

// The contract with everything that is recorded or built against these messages. From 0.1.0 on, a changed type is a new
// type with a new name, and a new line here; no line ever changes.
struct Contract {
  std::uint64_t fingerprint;
  std::size_t bytes;
};
const std::map<std::string, Contract> kContracts = {
    {"candidate_plan_t", {0xa26a21ec9821aaaa, 8538}},
    {"decision_t", {0x6c785a9e090fc6f2, 562}},
    {"execution_event_t", {0x4742c25e0eefd377, 336}},
    {"obstacle_shape_t", {0x29158dc0270b76d4, 406}},
    {"robot_state_t", {0x19608533667df4c6, 296}},
    {"transition_t", {0xc3ce61d7539f6402, 356}},
    {"logger_status_t", {0x2a2438623a759ef0, 260}},
    {"command_t", {0x1b315e627593a95f, 58}},
    {"fault_t", {0x85189bcc15840698, 866}},
    {"certifier_status_t", {0xf224554c7bae02b5, 1220}},
    {"obstacle_t", {0x8aa691d688813aa1, 520}},
    {"obstacles_t", {0x2779856ed0585bf4, 32830}},
    {"withdrawal_t", {0x143744ac67af3ba6, 482}},
    {"certified_plan_t", {0x35a4960598cd0ba9, 41978}},
    {"advice_change_t", {0x2820254c63772fe1, 56}},
    {"advice_t", {0xd9a32e31db904c49, 9202}},
    {"candidate_batch_t", {0x97b04e7ba99e785c, 62808}},
};

template <class Message>
struct MessageTest : testing::Test {
  // A message of random bits: every field differs from zero, doubles may be NaN with any payload.
  std::vector<std::uint8_t> RandomBytes() {
    std::vector<std::uint8_t> bytes = Encode(Message{});
    for (std::size_t i = 8; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(random_());
    return bytes;
  }

  FreshRandom random_;
};

using Messages = testing::Types<advice_change_t, advice_t, candidate_batch_t, candidate_plan_t, certified_plan_t,
                                certifier_status_t, command_t, decision_t, execution_event_t, fault_t, logger_status_t,
                                obstacle_shape_t, obstacle_t, obstacles_t, robot_state_t, transition_t, withdrawal_t>;
TYPED_TEST_SUITE(MessageTest, Messages);

TYPED_TEST(MessageTest, FingerprintAndSizeAreThoseOfTheContract) {
  const Contract contract = kContracts.at(TypeParam::getTypeName());
  EXPECT_EQ(static_cast<std::uint64_t>(TypeParam::getHash()), contract.fingerprint) << "the type is another";
  EXPECT_EQ(EncodedSize<TypeParam>(), contract.bytes);
}

TYPED_TEST(MessageTest, RoundTripKeepsEveryBit) {
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<std::uint8_t> bytes = this->RandomBytes();
    TypeParam message{};
    ASSERT_EQ(Decode(bytes, message), DecodeStatus::kOk);
    EXPECT_EQ(Encode(message), bytes);
  }
}

TYPED_TEST(MessageTest, EveryShorterLengthIsRefusedAndLeavesZero) {
  const std::vector<std::uint8_t> bytes = this->RandomBytes(), zero = Encode(TypeParam{});
  TypeParam message{};
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ASSERT_EQ(Decode(Bytes(bytes).first(size), message), DecodeStatus::kWrongLength) << size;
    if (size % 97 == 0) ASSERT_EQ(Encode(message), zero) << size;
  }
}

TYPED_TEST(MessageTest, OneByteMoreIsRefused) {
  std::vector<std::uint8_t> bytes = this->RandomBytes();
  bytes.push_back(0);
  TypeParam message{};
  EXPECT_EQ(Decode(bytes, message), DecodeStatus::kTrailingBytes);
  EXPECT_EQ(Encode(message), Encode(TypeParam{}));
}

TYPED_TEST(MessageTest, EveryBitOfTheFingerprintCounts) {
  for (int bit = 0; bit < 64; ++bit) {
    std::vector<std::uint8_t> bytes = this->RandomBytes();
    bytes[static_cast<std::size_t>(bit / 8)] ^= static_cast<std::uint8_t>(1 << bit % 8);
    TypeParam message{};
    ASSERT_EQ(Decode(bytes, message), DecodeStatus::kUnknownFingerprint) << bit;
    ASSERT_FALSE(Decoded<TypeParam>(bytes)) << bit;
  }
}

TEST(CodecTest, NoMessageIsTakenForAnother) {
  EXPECT_FALSE(Decoded<candidate_plan_t>(Encode(certified_plan_t{})));
  EXPECT_FALSE(Decoded<certified_plan_t>(Encode(candidate_plan_t{})));
  EXPECT_FALSE(Decoded<decision_t>(Encode(transition_t{})));
}

TEST(TextTest, FitsUpToOneByteLessThanTheField) {
  std::uint8_t field[8];
  for (const auto& [text, kept] : std::initializer_list<std::pair<std::string, std::string>>{
           {"", ""}, {"a", "a"}, {"1234567", "1234567"}, {"12345678", "1234567"}, {"123456789", "1234567"}}) {
    std::fill(std::begin(field), std::end(field), std::uint8_t{0xff});
    SetText(field, text);
    EXPECT_EQ(GetText(field), kept);
    for (std::size_t i = kept.size(); i < sizeof field; ++i) EXPECT_EQ(field[i], 0) << text << " " << i;
  }
}

TEST(TextTest, ReadsAFieldWithoutZeroAndEndsAtTheFirst) {
  const std::uint8_t full[4] = {'a', 'b', 'c', 'd'}, ended[4] = {'a', 0, 'c', 'd'};
  EXPECT_EQ(GetText(full), "abcd");
  EXPECT_EQ(GetText(ended), "a");
}

TEST(TextTest, ShowsOnlyPrintableAscii) {
  const std::uint8_t field[6] = {0x1f, 0x20, 0x7e, 0x7f, 0x80, 0xff};
  EXPECT_EQ(GetText(field), "? ~???");
}

TEST(DigestTest, IsBlake2bWith256Bits) {
  // RFC 7693's algorithm with 32 bytes of output, no key.
  EXPECT_EQ(ToHex(DigestOf(std::string_view(""))), "0e5751c026e543b2e8ab2eb06099daa1d1e5df47778f7787faab45cdf12fe3a8");
  EXPECT_EQ(ToHex(DigestOf(std::string_view("abc"))),
            "bddd813c634239723171ef3fee98579b94964e3bb1cb3e427262c8c068d52319");
}

TEST(DigestTest, GoesIntoAFieldAndBack) {
  decision_t decision{};
  const Digest digest = DigestOf(std::string_view("x"));
  SetDigest(decision.plan_digest, digest);
  EXPECT_EQ(GetDigest(decision.plan_digest), digest);
}

}  // namespace forereach::codec_test
