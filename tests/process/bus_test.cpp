#include "bus/bus.h"

#include <sched.h>
#include <unistd.h>

#include "tests/test.h"

#include "tests/messages.h"
#include "tests/process/process_fixture.h"
#include "tests/sanitized.h"

namespace forereach::bus_test {

robot_state_t State(std::int64_t sequence) { return robot_state_t{.sequence = sequence}; }

std::int64_t SequenceOf(const Received& received) { return Decoded<robot_state_t>(received.bytes).value().sequence; }

TEST(MemoryBusTest, DeliversInOrderStampedByItsClock) {
  std::int64_t now_us = 1000;
  const auto bus = OpenBus("memq://", [&now_us] { return now_us; });
  std::vector<std::pair<std::int64_t, std::int64_t>> heard;
  for (const char* channel : {"A", "B"})
    bus->Subscribe(channel, [&](const Received& r) { heard.emplace_back(SequenceOf(r), r.utime); });
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(bus->Publish(i == 1 ? "B" : "A", State(i)));
  EXPECT_TRUE(heard.empty()) << "nothing is delivered before Dispatch";
  now_us = 2000;
  EXPECT_EQ(bus->Dispatch(0), 3);
  now_us = 3000;
  bus->Publish("A", State(7));
  EXPECT_FIELDS(*bus, (Dispatch(0), 1), (Dispatch(0), 0));
  using P = std::pair<std::int64_t, std::int64_t>;
  EXPECT_THAT(heard, ElementsAre(P{0, 2000}, P{1, 2000}, P{2, 2000}, P{7, 3000}));
}

TEST(MemoryBusTest, WhatAHandlerPublishesComesWithTheNextDispatch) {
  const auto bus = OpenBus("memq://", [] { return 0; });
  std::vector<std::string> heard;
  bus->Subscribe("PING", [&](const Received& r) {
    heard.push_back(r.channel);
    bus->Publish("PONG", State(SequenceOf(r)));
  });
  bus->Subscribe("PONG", [&](const Received& r) { heard.push_back(r.channel); });
  bus->Publish("PING", State(1));
  bus->Publish("PING", State(2));
  EXPECT_FIELDS(*bus, (Dispatch(0), 2), (Dispatch(0), 2));
  EXPECT_THAT(heard, ElementsAre("PING", "PING", "PONG", "PONG"));
}

TEST(MemoryBusTest, ChannelsMatchAsAWhole) {
  const auto bus = OpenBus("memq://", [] { return 0; });
  std::vector<std::string> heard;
  bus->Subscribe("PLAN", [&](const Received& r) { heard.push_back(r.channel); });
  for (const char* channel : {"PLAN_CANDIDATE", "XPLAN", "PLAN"}) bus->Publish(channel, State(0));
  bus->Dispatch(0);
  EXPECT_THAT(heard, ElementsAre("PLAN"));
}

TEST(MemoryBusTest, EverySubscriberHears) {
  const auto bus = OpenBus("memq://", [] { return 0; });
  std::vector<int> heard;
  bus->Subscribe("A", [&](const Received&) { heard.push_back(1); });
  bus->Subscribe(".*", [&](const Received&) { heard.push_back(2); });
  bus->Publish("A", State(0));
  EXPECT_EQ(bus->Dispatch(0), 2);
  EXPECT_THAT(heard, UnorderedElementsAre(1, 2));
}

TEST(MemoryBusTest, TwoBusesDoNotHearEachOther) {
  const auto one = OpenBus("memq://"), other = OpenBus("memq://");
  int heard = 0;
  other->Subscribe("A", [&](const Received&) { ++heard; });
  one->Publish("A", State(0));
  one->Dispatch(0);
  other->Dispatch(0);
  EXPECT_EQ(heard, 0);
}

// The bounded queue drops the oldest and says so.
TEST(MemoryBusTest, CountsWhatItsQueueCannotHold) {
  const auto bus = OpenBus("memq://", [] { return 0; });
  std::vector<std::int64_t> heard;
  bus->Subscribe("A", [&](const Received& r) { heard.push_back(SequenceOf(r)); });
  constexpr std::int64_t kSent = 10'000;
  for (std::int64_t i = 0; i < kSent; ++i) bus->Publish("A", State(i));
  bus->Dispatch(0);
  EXPECT_GT(bus->dropped(), 0);
  EXPECT_EQ(std::ssize(heard) + bus->dropped(), kSent);
  EXPECT_FIELDS(heard, (back(), kSent - 1), (front(), bus->dropped()));
}

// Messages that are long are bounded by their bytes, before there are so many.
TEST(MemoryBusTest, DropsMessagesBeyondItsBoundOfBytes) {
  const auto bus = OpenBus("memq://", [] { return 0; });
  constexpr std::size_t kBound = std::size_t{32} << 20, kLongest = kMaxDatagramBytes - kDatagramHeaderBytes - 2;
  const std::vector<std::uint8_t> longest(kLongest), rest(kBound % kLongest), more(kBound % kLongest + 1);
  std::vector<std::size_t> heard;
  bus->Subscribe("A", [&](const Received& r) { heard.push_back(r.bytes.size()); });
  const auto heard_after = [&](const std::vector<std::uint8_t>& last) {
    heard.clear();
    for (std::size_t i = 0; i < kBound / kLongest; ++i) EXPECT_TRUE(bus->Publish("A", Bytes(longest)));
    EXPECT_TRUE(bus->Publish("A", Bytes(last)));
    bus->Dispatch(0);
    return heard.size();
  };
  EXPECT_EQ(heard_after(rest), kBound / kLongest + 1) << "exactly as many as there is room for";
  EXPECT_EQ(bus->dropped(), 0);
  EXPECT_EQ(heard_after(more), kBound / kLongest) << "the room is free again, and one byte too small";
  EXPECT_EQ(heard.back(), more.size()) << "the oldest made room";
  EXPECT_EQ(bus->dropped(), 1);
}

// Who handles a burst has it in memory twice, and keeps what was allocated last.
TEST(MemoryBusTest, GivesTheMemoryOfABurstBack) {
#if FOREREACH_SANITIZED
  GTEST_SKIP() << "the sanitizer's heap is another";
#endif
  const auto bus = OpenBus("memq://");
  std::vector<std::vector<std::uint8_t>> copies, kept;
  bus->Subscribe("A", [&](const Received& r) { copies.emplace_back(r.bytes.begin(), r.bytes.end()); });
  const std::vector<std::uint8_t> plan(40'000);
  for (int i = 0; i < 700; ++i) bus->Publish("A", Bytes(plan));
  const double before = ResidentBytes(::getpid());
  bus->Dispatch(0);
  const double in_burst = ResidentBytes(::getpid());
  kept.push_back(std::move(copies.back()));
  copies = {};
  constexpr double kBurst = 700 * 40'000;
  EXPECT_GT(in_burst, before + kBurst / 2);
  bus->Publish("A", Bytes(plan));
  bus->Dispatch(0);
  EXPECT_GT(ResidentBytes(::getpid()), in_burst - kBurst / 2) << "who does not wait has work to do";
  bus->Dispatch(1);
  EXPECT_LT(ResidentBytes(::getpid()), in_burst - kBurst / 2);
}

struct ThrowingHandlerTest : testing::TestWithParam<const char*> {
  std::string url() const { return std::string(GetParam()) == "memq" ? "memq://" : PrivateBusUrl(); }
};
INSTANTIATE_TEST_SUITE_P(Buses, ThrowingHandlerTest, testing::Values("memq", "udpm"),
                         [](const auto& instance) { return std::string(instance.param); });

TEST_P(ThrowingHandlerTest, LosesOnlyTheMessageOnWhichItThrows) {
  const auto bus = OpenBus(url());
  std::vector<std::int64_t> heard;
  bus->Subscribe("A", [&](const Received& r) {
    if (SequenceOf(r) % 2 == 1) throw std::runtime_error("odd");
    heard.push_back(SequenceOf(r));
  });
  int thrown = 0;
  for (std::int64_t i = 0; i < 6; ++i) {
    ASSERT_TRUE(bus->Publish("A", State(i)));
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    for (int handed_out = 0; handed_out == 0 && std::chrono::steady_clock::now() < deadline;) {
      try {
        handed_out = bus->Dispatch(100);
      } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "odd");
        handed_out = 1;
        ++thrown;
      }
    }
  }
  EXPECT_EQ(thrown, 3);
  EXPECT_THAT(heard, ElementsAre(0, 2, 4));
}

TEST(MemoryBusTest, AThrowingHandlerDoesNotKeepTheRestOfItsBatch) {
  const auto bus = OpenBus("memq://", [] { return 0; });
  std::vector<std::int64_t> heard;
  bus->Subscribe("A", [&](const Received& r) {
    heard.push_back(SequenceOf(r));
    if (heard.size() == 2) throw std::runtime_error("second");
  });
  for (std::int64_t i = 0; i < 4; ++i) bus->Publish("A", State(i));
  EXPECT_THROW(bus->Dispatch(0), std::runtime_error);
  EXPECT_THAT(heard, ElementsAre(0, 1, 2, 3));
}

TEST(MulticastBusTest, CarriesTheLargestMessageWholeAndInOrder) {
  const std::string url = PrivateBusUrl();
  BusProbe listener(url, {"PLAN_CERTIFIED"});
  const auto sender = OpenBus(url);
  std::vector<std::vector<std::uint8_t>> sent;
  for (int i = 0; i < 20; ++i) {
    certified_plan_t certified{};
    certified.sequence = i;
    for (int t = 0; t <= 128; ++t) certified.slice_upper[t][t % 16] = i + t;
    sent.push_back(Encode(certified));
    ASSERT_TRUE(sender->Publish("PLAN_CERTIFIED", Bytes(sent.back())));
    ASSERT_TRUE(listener.WaitUntil([&] { return listener.heard("PLAN_CERTIFIED").size() == sent.size(); })) << i;
  }
  EXPECT_EQ(listener.heard("PLAN_CERTIFIED"), sent);
  EXPECT_EQ(listener.bus().dropped(), 0);
}

TEST(MulticastBusTest, StampsWithTheTimeOfArrival) {
  const auto bus = OpenBus(PrivateBusUrl());
  std::int64_t utime = 0;
  bus->Subscribe("A", [&](const Received& r) { utime = r.utime; });
  const std::int64_t before = WallClockUs();
  bus->Publish("A", State(0));
  while (utime == 0 && WallClockUs() < before + 30'000'000) bus->Dispatch(100);
  EXPECT_GE(utime, before);
  EXPECT_LE(utime, WallClockUs());
}

TEST(BusErrorTest, WithoutAMulticastRouteThereIsAdvice) {
  std::string error;
  bool alone = false;
  std::thread([&] {  // a network of its own, without routes, for this thread alone
    alone = ::unshare(CLONE_NEWNET) == 0;
    if (!alone) return;
    try {
      (void)OpenBus("udpm://239.255.76.67:7667?ttl=0");
    } catch (const BusError& thrown) {
      error = thrown.what();
    }
  })
      .join();
  if (!alone) GTEST_SKIP() << "a network of its own needs root";
  EXPECT_THAT(error, AllOf(HasSubstr("udpm://239.255.76.67:7667"), HasSubstr("ip route add 224.0.0.0/4 dev lo")));
}

TEST(BusErrorTest, OtherKindsOfBusAreRefused) {
  for (const char* url : {"", "nonsense", "nonsense://", "file:///tmp/x?mode=w", "tcpq://localhost:7700", "UDPM://x"})
    EXPECT_THROW((void)OpenBus(url), BusError) << url;
}

}  // namespace forereach::bus_test
