// The screen and the two queues behind it, on both kinds of bus.
#include <atomic>

#include "tests/test.h"

#include "tests/process/process_fixture.h"

namespace forereach::screen_test {

constexpr std::uint8_t kGood = 1, kBad = 2, kThrows = 3, kElsewhere = 4;

// A message is its bytes behind the first one, which says what becomes of it.
struct FirstByteScreen final : Screen {
  std::optional<Bytes> Admit(const std::string& channel, Bytes raw) override {
    static const std::vector<std::uint8_t> elsewhere(3);
    asked_.push_back(channel);
    ++count_;
    thread_ = std::this_thread::get_id();
    if (raw.empty() || raw[0] == kBad) return std::nullopt;
    if (raw[0] == kThrows) throw std::runtime_error("the screen fails");
    if (raw[0] == kElsewhere) return Bytes(elsewhere);
    return raw.subspan(1);
  }

  std::vector<std::string> asked_;
  std::atomic<int> count_ = 0;
  std::thread::id thread_;
};

struct ScreenTest : testing::TestWithParam<const char*> {
  using Raw = std::vector<std::uint8_t>;
  struct Heard {
    Raw bytes, raw;
    bool operator==(const Heard&) const = default;
  };

  Bus::Handler Into(std::vector<Heard>& heard) {
    return [&heard](const Received& r) {
      heard.push_back({{r.bytes.begin(), r.bytes.end()}, {r.raw.begin(), r.raw.end()}});
    };
  }
  void Send(const std::string& channel, const Raw& raw) { ASSERT_TRUE(bus_->Publish(channel, Bytes(raw))); }
  // Everything sent before it has then been received: the order is kept.
  void DispatchAll() {
    bool ended = false;
    bus_->Subscribe("END", [&ended](const Received&) { ended = true; });
    Send("END", {kGood});
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (!ended && std::chrono::steady_clock::now() < deadline) bus_->Dispatch(10);
    ASSERT_TRUE(ended);
  }

  const std::shared_ptr<FirstByteScreen> screen_ = std::make_shared<FirstByteScreen>();
  const std::unique_ptr<Bus> bus_ =
      OpenBus(std::string(GetParam()) == "memq" ? "memq://" : PrivateBusUrl(), WallClockUs, screen_);
};
INSTANTIATE_TEST_SUITE_P(Buses, ScreenTest, testing::Values("memq", "udpm"),
                         [](const auto& instance) { return std::string(instance.param); });

TEST_P(ScreenTest, HandlersGetAdmittedMessagesWithoutTheirTrailer) {
  std::vector<Heard> heard;
  bus_->Subscribe("A", Into(heard));
  Send("A", {kGood, 10, 11});
  Send("A", {kBad, 12});
  Send("A", {kGood});
  DispatchAll();
  EXPECT_THAT(heard, ElementsAre(Heard{{10, 11}, {kGood, 10, 11}}, Heard{{}, {kGood}}));
  EXPECT_EQ(bus_->dropped(), 0) << "refused is not dropped";
}

TEST_P(ScreenTest, UncheckedHandlersGetEveryMessageInOrderWithoutTheContentOfRefusedOnes) {
  std::vector<Heard> heard, checked;
  bus_->SubscribeUnchecked(Bus::kEveryChannel, Into(heard));
  bus_->Subscribe("A", Into(checked));
  Send("A", {kBad, 12});
  Send("A", {kGood, 10});
  Send("A", {});
  DispatchAll();
  EXPECT_THAT(heard, ElementsAre(Heard{{}, {kBad, 12}}, Heard{{10}, {kGood, 10}}, Heard{{}, {}}, Heard{{}, {kGood}}));
  EXPECT_THAT(checked, ElementsAre(Heard{{10}, {kGood, 10}}));
}

TEST_P(ScreenTest, IsAskedOnceForEachMessageThatSomebodyWantsAndForNoOther) {
  std::vector<Heard> heard;
  for (int i = 0; i < 3; ++i) bus_->Subscribe("A", Into(heard));
  Send("NOBODY", {kGood});
  Send("A", {kGood});
  Send("AB", {kGood});
  DispatchAll();
  EXPECT_THAT(screen_->asked_, ElementsAre("A", "END"));
  EXPECT_EQ(heard.size(), 3u);
}

TEST_P(ScreenTest, RunsOnTheReceivingThreadOfAUdpmBus) {
  DispatchAll();
  EXPECT_EQ(screen_->thread_ == std::this_thread::get_id(), std::string(GetParam()) == "memq");
}

TEST_P(ScreenTest, AMessageForWhichItThrowsIsLostAndCounted) {
  std::vector<Heard> heard;
  bus_->SubscribeUnchecked("A", Into(heard));
  for (const std::uint8_t first : {kThrows, kElsewhere, kGood}) Send("A", {first});
  DispatchAll();
  EXPECT_THAT(heard, ElementsAre(Heard{{}, {kGood}})) << "the bus stays usable";
  EXPECT_EQ(bus_->dropped(), 2) << "bytes that are not the message's count as a failure too";
}

// So that a flood of forged messages costs no honest one.
TEST_P(ScreenTest, RefusedMessagesNeverDisplaceAdmittedOnes) {
  std::vector<Heard> heard;
  bus_->SubscribeUnchecked("A", Into(heard));
  constexpr int kForged = 1000;
  for (int i = 0; i < 5; ++i) Send("A", {kGood, static_cast<std::uint8_t>(i)});
  for (int i = 0; i < kForged; ++i) Send("A", {kBad, static_cast<std::uint8_t>(i)});
  const auto all_received = [this] { return screen_->count_ >= 5 + kForged; };
  if (std::string(GetParam()) == "udpm")
    for (int i = 0; i < 3000 && !all_received(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  DispatchAll();
  EXPECT_EQ(std::ranges::count_if(heard, [](const Heard& h) { return h.raw[0] == kGood; }), 5);
  EXPECT_EQ(std::ranges::count_if(heard, [](const Heard& h) { return h.raw[0] == kBad; }), 256);
  EXPECT_FIELDS(*bus_, (refused_dropped(), kForged - 256), (dropped(), 0));
}

TEST_P(ScreenTest, RefusedMessagesAreBoundedByTheirBytes) {
  std::vector<Heard> heard;
  bus_->SubscribeUnchecked("A", Into(heard));
  Raw forged(60'000);
  forged[0] = kBad;
  constexpr int kForged = 100, kFit = (4 << 20) / 60'000;
  for (int i = 0; i < kForged; ++i) {
    Send("A", forged);
    if (std::string(GetParam()) == "udpm") std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  DispatchAll();
  EXPECT_EQ(heard.size(), std::size_t{kFit});
  EXPECT_EQ(bus_->refused_dropped(), kForged - kFit);
}

TEST_P(ScreenTest, WhatDoesNotFitOneDatagramOrHasNoNameIsNotSent) {
  std::vector<Heard> heard;
  bus_->Subscribe(Bus::kEveryChannel, Into(heard));
  Raw longest(kMaxDatagramBytes - kDatagramHeaderBytes - 2);
  longest[0] = kGood;
  EXPECT_TRUE(bus_->Publish("A", Bytes(longest)));
  longest.push_back(0);
  EXPECT_FALSE(bus_->Publish("A", Bytes(longest))) << "LCM would send it in fragments";
  const Raw message{kGood};
  for (const std::string& name : {std::string(), std::string(64, 'A'), std::string("A\n"), std::string("A\0B", 3)})
    EXPECT_FALSE(bus_->Publish(name, Bytes(message))) << name;
  DispatchAll();
  EXPECT_EQ(heard.size(), 2u) << "the first, and what DispatchAll sends";
}

}  // namespace forereach::screen_test
