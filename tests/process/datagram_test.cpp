// The parser of datagrams, at every boundary.
#include "bus/datagram.h"

#include "tests/test.h"

#include "tests/process/raw_datagrams.h"

namespace forereach::datagram_test {

DatagramKind KindOf(const RawDatagram& bytes) {
  const Datagram datagram = ParseDatagram(bytes);
  if (datagram.kind != DatagramKind::kMessage)
    EXPECT_FIELDS(datagram, (channel.empty(), true), (payload.empty(), true));
  return datagram.kind;
}

RawDatagram OfText(std::string_view text) { return {text.begin(), text.end()}; }

RawDatagram Named(const std::string& name) { return ShortMessage(name, {}); }

TEST(DatagramTest, AMessageIsItsChannelAndPayload) {
  const RawDatagram payload{0, 1, 2, 0, 255}, bytes = ShortMessage("PLAN", payload);
  const Datagram datagram = ParseDatagram(bytes);
  ASSERT_EQ(datagram.kind, DatagramKind::kMessage);
  EXPECT_EQ(datagram.channel, "PLAN");
  EXPECT_EQ(RawDatagram(datagram.payload.begin(), datagram.payload.end()), payload);
  EXPECT_EQ(datagram.payload.data() + datagram.payload.size(), bytes.data() + bytes.size()) << "inside what came";
}

TEST(DatagramTest, APayloadMayBeEmptyOrFillTheDatagram) {
  EXPECT_TRUE(ParseDatagram(Named("A")).payload.empty());
  const RawDatagram longest(kMaxDatagramBytes - kDatagramHeaderBytes - 2, 7), bytes = ShortMessage("A", longest);
  EXPECT_EQ(bytes.size(), kMaxDatagramBytes);
  EXPECT_EQ(ParseDatagram(bytes).payload.size(), longest.size());
}

TEST(DatagramTest, EverythingShorterThanTheHeaderIsTooShort) {
  const RawDatagram whole = Named("A");
  for (std::size_t bytes = 0; bytes < kDatagramHeaderBytes; ++bytes)
    EXPECT_EQ(KindOf({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(bytes)}), DatagramKind::kTooShort)
        << bytes;
}

TEST(DatagramTest, OnlyTheTwoMagicsAreLcm) {
  for (int bit = 0; bit < 32; ++bit) {
    RawDatagram bytes = Named("A");
    bytes[static_cast<std::size_t>(bit) / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    EXPECT_EQ(KindOf(bytes), bit == 24 ? DatagramKind::kFragment : DatagramKind::kNotLcm) << bit;  // '2' to '3'
  }
}

TEST(DatagramTest, EveryFragmentIsRefusedWhateverItClaims) {
  EXPECT_EQ(KindOf(OfText("LC031234")), DatagramKind::kFragment) << "nothing behind its magic is read";
  for (const auto& datagrams : {WrappingFragment("A"), HugeClaims("A")})
    for (const RawDatagram& bytes : datagrams) EXPECT_EQ(KindOf(bytes), DatagramKind::kFragment);
}

TEST(DatagramTest, ANameHasAnEndWithinTheDatagramAndTheLimit) {
  EXPECT_EQ(KindOf(OfText("LC02seqn")), DatagramKind::kUnterminatedName) << "no name at all";
  EXPECT_EQ(KindOf(OfText("LC02seqnA")), DatagramKind::kUnterminatedName);
  EXPECT_EQ(KindOf(Named(std::string(kMaxChannelBytes, 'A'))), DatagramKind::kMessage);
  EXPECT_EQ(KindOf(Named(std::string(kMaxChannelBytes + 1, 'A'))), DatagramKind::kUnterminatedName);
  RawDatagram cut = Named(std::string(kMaxChannelBytes, 'A'));
  cut.pop_back();
  EXPECT_EQ(KindOf(cut), DatagramKind::kUnterminatedName);
  for (const RawDatagram& bytes : EndlessNames()) EXPECT_NE(KindOf(bytes), DatagramKind::kMessage);
}

TEST(DatagramTest, ANameIsPrintable) {
  EXPECT_EQ(KindOf(Named("")), DatagramKind::kBadName);
  for (int c = 1; c < 256; ++c) {
    const std::string name{'A', static_cast<char>(c)};
    EXPECT_EQ(KindOf(Named(name)), c >= 32 && c < 127 ? DatagramKind::kMessage : DatagramKind::kBadName) << c;
    EXPECT_EQ(IsChannelName(name), c >= 32 && c < 127) << c;
  }
  EXPECT_TRUE(IsChannelName(std::string(kMaxChannelBytes, 'A')));
  EXPECT_FALSE(IsChannelName(std::string(kMaxChannelBytes + 1, 'A')));
  EXPECT_FALSE(IsChannelName(std::string_view("A\0B", 3)));
}

TEST(DatagramTest, AnySequenceNumberIsTaken) {
  for (const std::uint32_t sequence : {0u, 1u, 0x8000'0000u, 0xffff'ffffu})
    EXPECT_EQ(KindOf(ShortMessage("A", {}, sequence)), DatagramKind::kMessage);
}

TEST(DatagramTest, AMessageFitsUpToTheLargestDatagram) {
  for (const std::size_t name : {std::size_t{1}, std::size_t{14}, kMaxChannelBytes}) {
    const std::size_t longest = kMaxDatagramBytes - kDatagramHeaderBytes - name - 1;
    EXPECT_TRUE(FitsOneDatagram(name, longest)) << name;
    EXPECT_FALSE(FitsOneDatagram(name, longest + 1)) << name;
    EXPECT_FALSE(FitsOneDatagram(name, ~std::size_t{0})) << name;
  }
  EXPECT_FALSE(FitsOneDatagram(kMaxChannelBytes + 1, 0));
}

TEST(DatagramTest, RefusedOnesAreCountedByTheirCauseAndSaid) {
  DatagramCounts counts;
  counts.Count(DatagramKind::kMessage);
  EXPECT_EQ(counts.refused(), 0);
  EXPECT_EQ(DescribeRefused(counts), "");
  for (const DatagramKind kind : {DatagramKind::kTooShort, DatagramKind::kNotLcm, DatagramKind::kFragment,
                                  DatagramKind::kFragment, DatagramKind::kUnterminatedName, DatagramKind::kBadName})
    counts.Count(kind);
  counts.truncated = 1;
  EXPECT_FIELDS(counts, (messages, 1), (refused(), 7));
  const std::string words = DescribeRefused(counts);
  for (const char* part :
       {"2 fragments", "1 not of LCM", "1 too short", "1 without the end", "1 with a channel's name", "1 truncated"})
    EXPECT_THAT(words, HasSubstr(part));
}

}  // namespace forereach::datagram_test
