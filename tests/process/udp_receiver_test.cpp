// Datagrams at the socket: by group, port and kind; their counts; their cost in memory.
#include "bus/udp_receiver.h"

#include <csignal>
#include <mutex>

#include <netinet/ip.h>
#include <pthread.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/test.h"

#include "tests/process/process_fixture.h"
#include "tests/process/raw_datagrams.h"
#include "tests/sanitized.h"

namespace forereach::udp_receiver_test {

struct UdpReceiverTest : testing::Test {
  explicit UdpReceiverTest(const std::string& options = "") : url_(PrivateBusUrl() + options) {}

  void Deliver(std::string_view channel, std::int64_t utime) {
    deliver_calls_here_ = true;
    const std::unique_lock waits_for_test(slow_);
    const std::lock_guard lock(mutex_);
    heard_.emplace_back(channel);
    utime_ = utime;
  }
  std::vector<std::string> heard() {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  bool WaitUntil(const std::function<bool()>& done) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (!done() && std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return done();
  }
  bool HeardLast(const std::string& channel) {
    return WaitUntil([&] {
      const auto all = heard();
      return !all.empty() && all.back() == channel;
    });
  }

  const std::string url_;
  std::mutex mutex_, slow_;
  std::vector<std::string> heard_;
  std::int64_t utime_ = 0;
  std::atomic<bool> deliver_calls_here_ = false;
  const RawSender sender_{url_};
  UdpReceiver receiver_{ParseMulticastUrl(url_),
                        [this](std::string_view channel, Bytes, std::int64_t utime) { Deliver(channel, utime); }};
};

TEST_F(UdpReceiverTest, CountsWhatItRefusesByItsCause) {
  sender_.Send(Bytes());
  for (const auto& datagrams : {WrappingFragment("A"), HugeClaims("A"), EndlessNames()})
    ASSERT_TRUE(sender_.Send(datagrams));
  sender_.Send(Bytes(ShortMessage("", {})));
  sender_.Send(Bytes(RawDatagram(100, 'x')));
  sender_.Send(Bytes(ShortMessage("LAST", {})));
  ASSERT_TRUE(HeardLast("LAST"));
  const DatagramCounts counts = receiver_.counts();
  EXPECT_FIELDS(counts, (messages, 1), (too_short, 1), (fragments, 1 + 20 + 5), (unterminated_names, 5), (bad_names, 1),
                (not_lcm, 1), (truncated, 0), (lost_by_kernel, 0), (receive_errors, 0));
  EXPECT_THAT(heard(), ElementsAre("LAST"));
}

TEST_F(UdpReceiverTest, HearsItsGroupAndPortAlone) {
  const MulticastUrl own = ParseMulticastUrl(url_);
  const std::string port = std::to_string(own.port), other = std::to_string(own.port - 5000);
  // A neighbour that has joined another group on this port, and one that has this group's other port.
  const UdpReceiver other_group(ParseMulticastUrl("udpm://239.255.76.68:" + port), [](auto, auto, auto) {});
  const UdpReceiver other_port(ParseMulticastUrl("udpm://239.255.76.67:" + other), [](auto, auto, auto) {});
  const Bytes message = Bytes();
  EXPECT_TRUE(sender_.SendToHost(Bytes(ShortMessage("TO_HOST", message))));
  EXPECT_TRUE(RawSender("udpm://239.255.76.68:" + port).Send(Bytes(ShortMessage("OTHER_GROUP", message))));
  EXPECT_TRUE(RawSender("udpm://239.255.76.67:" + other).Send(Bytes(ShortMessage("OTHER_PORT", message))));
  EXPECT_TRUE(sender_.Send(Bytes(ShortMessage("OURS", message))));
  ASSERT_TRUE(HeardLast("OURS"));
  EXPECT_THAT(heard(), ElementsAre("OURS"));
}

TEST_F(UdpReceiverTest, StampsWithTheKernelsTimeOfArrival) {
  const std::int64_t before = WallClockUs();
  std::unique_lock keeps_it_waiting(slow_);
  sender_.Send(Bytes(ShortMessage("FIRST", {})));
  ASSERT_TRUE(WaitUntil([this] { return deliver_calls_here_.load(); }));
  sender_.Send(Bytes(ShortMessage("WAITS", {})));
  const std::int64_t sent = WallClockUs();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  keeps_it_waiting.unlock();
  ASSERT_TRUE(HeardLast("WAITS"));
  EXPECT_GE(utime_, before);
  EXPECT_LE(utime_, sent + 20'000) << "when it came, not when it was read";
}

TEST_F(UdpReceiverTest, WithIpOptionsOrAnyTimeToLiveAMessageIsAMessage) {
  const unsigned char no_operations[4] = {IPOPT_NOOP, IPOPT_NOOP, IPOPT_NOOP, IPOPT_END}, far = 255;
  ASSERT_EQ(::setsockopt(sender_.handle(), IPPROTO_IP, IP_OPTIONS, no_operations, sizeof no_operations), 0);
  sender_.Send(Bytes(ShortMessage("OPTIONS", {})));
  ASSERT_EQ(::setsockopt(sender_.handle(), IPPROTO_IP, IP_OPTIONS, nullptr, 0), 0);
  ASSERT_EQ(::setsockopt(sender_.handle(), IPPROTO_IP, IP_MULTICAST_TTL, &far, sizeof far), 0);
  sender_.Send(Bytes(ShortMessage("FAR", {})));
  ASSERT_TRUE(HeardLast("FAR"));
  EXPECT_THAT(heard(), ElementsAre("OPTIONS", "FAR"));
}

// A signal makes the receiving thread's recvmsg fail; it goes on.
TEST_F(UdpReceiverTest, ReceivesOnAfterASignal) {
  struct sigaction action {
  }, before{};
  action.sa_handler = [](int) {};
  ::sigaction(SIGUSR1, &action, &before);
  sigset_t mine, old;
  sigemptyset(&mine);
  sigaddset(&mine, SIGUSR1);
  ::pthread_sigmask(SIG_BLOCK, &mine, &old);  // so the receiving thread gets it
  for (int i = 0; i < 20; ++i) {
    ::kill(::getpid(), SIGUSR1);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  sender_.Send(Bytes(ShortMessage("STILL_HERE", {})));
  EXPECT_TRUE(HeardLast("STILL_HERE"));
  EXPECT_EQ(receiver_.counts().receive_errors, 0);
  ::pthread_sigmask(SIG_SETMASK, &old, nullptr);
  ::sigaction(SIGUSR1, &before, nullptr);
}

TEST_F(UdpReceiverTest, NoDatagramMakesItsMemoryGrow) {
  std::mt19937 random(7);
  const RawDatagram real = ShortMessage("ROBOT_STATE", RawDatagram(300, 5));
  const double before = ResidentBytes(::getpid());
  constexpr int kSent = 30'000;
  for (int i = 0; i < kSent; ++i) {
    sender_.Send(Bytes(RandomFragment(random, "ROBOT_STATE")));
    sender_.Send(Bytes(RandomBytes(random, 200)));
    if (i % 3 == 0) sender_.Send(Bytes(Mutated(random, real)));
  }
  sender_.Send(Bytes(ShortMessage("LAST", {})));
  const auto everything_came = [&] {
    const DatagramCounts counts = receiver_.counts();
    return counts.messages + counts.refused() + counts.lost_by_kernel >= 2 * kSent + kSent / 3 + 1;
  };
  WaitUntil([&] {
    sender_.Send(Bytes(ShortMessage("LAST", {})));  // the kernel tells of losses with what comes behind them
    return everything_came();
  });
  EXPECT_TRUE(everything_came());
#if !FOREREACH_SANITIZED  // a sanitizer's heap is another
  EXPECT_LT(ResidentBytes(::getpid()) - before, 8 << 20);
#endif
}

struct SmallBufferTest : UdpReceiverTest {
  SmallBufferTest() : UdpReceiverTest("&recv_buf_size=20000") {}
};

TEST_F(SmallBufferTest, CountsWhatTheKernelCouldNotKeep) {
  constexpr int kSent = 500;
  std::unique_lock keeps_it_waiting(slow_);
  const RawDatagram message = ShortMessage("FLOOD", RawDatagram(1000, 1));
  for (int i = 0; i < kSent; ++i) ASSERT_TRUE(sender_.Send(Bytes(message)));
  keeps_it_waiting.unlock();
  std::int64_t sent = kSent;
  EXPECT_TRUE(WaitUntil([&] {  // the kernel tells of losses with what comes behind them
    sender_.Send(Bytes(ShortMessage("AFTER", {})));
    ++sent;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const DatagramCounts counts = receiver_.counts();
    return counts.lost_by_kernel > 0 && counts.messages + counts.lost_by_kernel == sent;
  }));
  EXPECT_GT(receiver_.counts().lost_by_kernel, kSent / 2);
}

TEST(BusCountsTest, WhatTheKernelLostIsDroppedByTheBus) {
  const std::string url = PrivateBusUrl() + "&recv_buf_size=20000";
  struct SlowScreen final : Screen {
    std::optional<Bytes> Admit(const std::string&, Bytes raw) override {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      return raw;
    }
  };
  const auto bus = OpenBus(url, WallClockUs, std::make_shared<SlowScreen>());
  bus->Subscribe("FLOOD", [](const Received&) {});
  const RawSender sender(url);
  for (int i = 0; i < 200; ++i) sender.Send(Bytes(ShortMessage("FLOOD", RawDatagram(1000, 1))));
  sender.Send(WrappingFragment("FLOOD"));
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (bus->dropped() == 0 && std::chrono::steady_clock::now() < deadline) {
    sender.Send(WrappingFragment("FLOOD"));
    bus->Dispatch(5);
  }
  EXPECT_GT(bus->dropped(), 0);
  EXPECT_EQ(bus->dropped(), bus->datagrams().lost_by_kernel);
  EXPECT_GT(bus->datagrams().messages, 0);
}

}  // namespace forereach::udp_receiver_test
