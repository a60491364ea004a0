#include "bus/bus.h"

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include <lcm/lcm-cpp.hpp>

#include "bus/inbox.h"
#include "bus/udp_receiver.h"

namespace forereach {
namespace {

// The common part of both kinds of bus.
class InboxBus : public Bus {
 public:
  explicit InboxBus(const std::shared_ptr<Screen>& screen) : inbox_(screen), screen_(screen) {}

  void Subscribe(const std::string& channel, Handler handler) override {
    inbox_.Subscribe(channel, std::move(handler), false);
  }
  void SubscribeUnchecked(const std::string& channel, Handler handler) override {
    inbox_.Subscribe(channel, std::move(handler), true);
  }
  bool Publish(const std::string& channel, Bytes bytes) override {
    if (!screen_) return SendIfItFits(channel, bytes);
    const std::optional<std::vector<std::uint8_t>> message = screen_->ToSend(channel, bytes);
    return message && SendIfItFits(channel, *message);
  }
  int Dispatch(int timeout_ms) override {
    const int calls = HandOut(timeout_ms);
    // Only by a caller that has time to wait.
    if (timeout_ms > 0) inbox_.GiveBack();
    return calls;
  }
  bool has_waiting() const override { return inbox_.has_waiting(); }
  std::int64_t dropped() const override { return inbox_.dropped(); }
  std::int64_t refused_dropped() const override { return inbox_.refused_dropped(); }
  Refusals refusals() const override { return screen_ ? screen_->refusals() : Refusals{}; }

 protected:
  virtual bool Send(const std::string& channel, Bytes bytes) = 0;
  virtual int HandOut(int timeout_ms) = 0;

  Inbox inbox_;

 private:
  bool SendIfItFits(const std::string& channel, Bytes bytes) {
    return IsChannelName(channel) && FitsOneDatagram(channel.size(), bytes.size()) && Send(channel, bytes);
  }

  const std::shared_ptr<Screen> screen_;
};

class MemoryBus final : public InboxBus {
 public:
  MemoryBus(Clock clock, const std::shared_ptr<Screen>& screen) : InboxBus(screen), clock_(std::move(clock)) {}

  // What was sent waits for this thread, too.
  bool has_waiting() const override {
    const std::lock_guard lock(mutex_);
    return !sent_.empty() || inbox_.has_waiting();
  }

 private:
  struct Sent {
    std::string channel;
    std::vector<std::uint8_t> bytes;
  };

  bool Send(const std::string& channel, Bytes bytes) override {
    {
      const std::lock_guard lock(mutex_);
      sent_.push_back({channel, {bytes.begin(), bytes.end()}});
    }
    has_sent_.notify_one();
    return true;
  }

  int HandOut(int timeout_ms) override {
    std::deque<Sent> sent;
    {
      std::unique_lock lock(mutex_);
      if (timeout_ms > 0)
        has_sent_.wait_for(lock, std::chrono::milliseconds(timeout_ms), [this] { return !sent_.empty(); });
      sent.swap(sent_);
    }
    for (; !sent.empty(); sent.pop_front()) inbox_.Put(sent.front().channel, sent.front().bytes, clock_());
    return inbox_.HandOut(0);
  }

  const Clock clock_;
  mutable std::mutex mutex_;  // guards sent_
  std::condition_variable has_sent_;
  std::deque<Sent> sent_;
};

// LCM only sends: an lcm_t without subscriptions opens no receiving socket.
class MulticastBus final : public InboxBus {
 public:
  MulticastBus(const MulticastUrl& url, const std::shared_ptr<Screen>& screen)
      : InboxBus(screen),
        receiver_(url, [this](std::string_view channel, Bytes payload,
                              std::int64_t utime) { inbox_.Put(channel, payload, utime); }),
        sender_(url.ForSending()) {
    if (!sender_.good()) throw std::system_error(std::make_error_code(std::errc::network_unreachable), "LCM's sender");
  }

  std::int64_t dropped() const override { return inbox_.dropped() + receiver_.counts().lost_by_kernel; }
  DatagramCounts datagrams() const override { return receiver_.counts(); }

 private:
  bool Send(const std::string& channel, Bytes bytes) override {
    return sender_.publish(channel, bytes.data(), static_cast<unsigned>(bytes.size())) == 0;
  }
  int HandOut(int timeout_ms) override { return inbox_.HandOut(timeout_ms); }

  UdpReceiver receiver_;
  lcm::LCM sender_;
};

}  // namespace

std::unique_ptr<Bus> OpenBus(const std::string& url, Clock clock, const std::shared_ptr<Screen>& screen) {
  if (url.starts_with("memq://")) return std::make_unique<MemoryBus>(std::move(clock), screen);
  if (!url.starts_with("udpm://"))
    throw BusError(
        fmt::format("bus: {} has to begin with udpm:// or memq://, as in udpm://239.255.76.67:7667?ttl=0", url));
  try {
    return std::make_unique<MulticastBus>(ParseMulticastUrl(url), screen);
  } catch (const std::system_error& error) {
    throw BusError(
        fmt::format("bus: cannot open {}: {}. Is there a multicast route? `ip link set lo up; ip route add 224.0.0.0/4 "
                    "dev lo` as root; `forereach doctor` checks it",
                    url, error.what()));
  }
}

std::string BusVersion() { return fmt::format("{}.{}.{}", LCM_MAJOR_VERSION, LCM_MINOR_VERSION, LCM_MICRO_VERSION); }

}  // namespace forereach
