#include "lcmtypes/bus.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <fstream>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <lcm/lcm-cpp.hpp>
#include <malloc.h>

namespace forereach {
namespace {

constexpr std::size_t kQueueMessages = 4096, kQueueBytes = std::size_t{32} << 20;  // 800 certified plans
constexpr std::size_t kBurstBytes = std::size_t{1} << 20;
constexpr int kLcmQueueMessages = 1024;
constexpr int kReceivePollMs = 50;

// As much as the kernel grants: LCM complains where it is asked for more.
std::string WithReceiveBuffer(const std::string& url) {
  if (!url.starts_with("udpm://") || url.find("recv_buf_size=") != std::string::npos) return url;
  const long granted = GrantedReceiveBufferBytes();
  if (granted <= 0) return url;
  return url + (url.find('?') == std::string::npos ? '?' : '&') +
         "recv_buf_size=" + std::to_string(std::min(granted, kReceiveBufferBytes));
}

class LcmBus final : public Bus {
 public:
  LcmBus(const std::string& url, Clock clock)
      : in_memory_(url.starts_with("memq://")), clock_(std::move(clock)), lcm_(WithReceiveBuffer(url)) {
    // Asking for the file descriptor joins the multicast group, which a subscription would do without telling of failure.
    if (!lcm_.good() || (!in_memory_ && lcm_.getFileno() < 0))
      throw BusError("bus: cannot open " + url +
                     ". Is there a multicast route? `ip link set lo up; ip route add 224.0.0.0/4 dev lo` as root; "
                     "`forereach doctor` checks it");
  }

  ~LcmBus() override {
    stopping_ = true;
    if (receiver_.joinable()) receiver_.join();
  }

  void Subscribe(const std::string& channel, Handler handler) override {
    std::lock_guard lock(mutex_);
    subscriptions_.push_back(std::make_unique<Subscription>(Subscription{this, std::move(handler)}));
    lcm_.subscribeFunction(channel, &LcmBus::CopyOut, subscriptions_.back().get())
        ->setQueueCapacity(kLcmQueueMessages);
    if (!in_memory_ && !receiver_.joinable()) receiver_ = std::thread([this] { Receive(); });
  }

  bool Publish(const std::string& channel, Bytes bytes) override {
    return lcm_.publish(channel, bytes.data(), static_cast<unsigned>(bytes.size())) == 0;
  }

  int Dispatch(int timeout_ms) override {
    if (in_memory_ && lcm_.handleTimeout(timeout_ms) > 0) while (lcm_.handleTimeout(0) > 0) {}
    std::deque<Stored> batch;
    std::size_t bytes = 0;
    {
      std::unique_lock lock(mutex_);
      if (!in_memory_) arrived_.wait_for(lock, std::chrono::milliseconds(timeout_ms), [this] { return !queue_.empty(); });
      batch.swap(queue_);
      std::swap(bytes, queued_bytes_);
    }
    std::exception_ptr failure;
    for (const Stored& stored : batch) {
      try {
        (*stored.handler)(Received{stored.channel, stored.bytes, stored.utime});
      } catch (...) {
        failure = std::current_exception();
      }
    }
    if (bytes > kBurstBytes)
      was_in_burst_ = true;
    else if (timeout_ms > 0)
      GiveBack();
    if (failure) std::rethrow_exception(failure);
    return static_cast<int>(batch.size());
  }

  std::int64_t dropped() const override { return dropped_; }

 private:
  struct Subscription {
    LcmBus* bus;
    Handler handler;
  };
  struct Stored {
    std::string channel;
    std::vector<std::uint8_t> bytes;
    std::int64_t utime;
    const Handler* handler;
  };

  // Runs inside LCM's C code: nothing may be thrown through it.
  static void CopyOut(const lcm::ReceiveBuffer* buffer, const std::string& channel, Subscription* subscription) {
    LcmBus& bus = *subscription->bus;
    try {
      std::lock_guard lock(bus.mutex_);
      const std::int64_t utime = bus.in_memory_ ? bus.clock_() : buffer->recv_utime;
      const auto* data = static_cast<const std::uint8_t*>(buffer->data);
      bus.Store({channel, {data, data + buffer->data_size}, utime, &subscription->handler});
    } catch (...) {
      ++bus.dropped_;
    }
    bus.arrived_.notify_one();
  }

  // The oldest make room. A message longer than all of the room is kept alone.
  void Store(Stored stored) {
    queued_bytes_ += stored.bytes.size();
    queue_.push_back(std::move(stored));
    while (queue_.size() > 1 && (queue_.size() > kQueueMessages || queued_bytes_ > kQueueBytes)) {
      queued_bytes_ -= queue_.front().bytes.size();
      queue_.pop_front();
      ++dropped_;
    }
  }

  // What a burst and who handled it took of the heap goes back to the system, once there is time for it: that takes some
  // milliseconds.
  void GiveBack() {
    if (std::exchange(was_in_burst_, false)) ::malloc_trim(0);
  }

  void Receive() {
    while (!stopping_) lcm_.handleTimeout(kReceivePollMs);
  }

  const bool in_memory_;
  const Clock clock_;
  lcm::LCM lcm_;
  std::mutex mutex_;  // guards queue_, queued_bytes_ and subscriptions_
  std::condition_variable arrived_;
  std::deque<Stored> queue_;
  std::size_t queued_bytes_ = 0;
  bool was_in_burst_ = false;  // only the thread that dispatches looks
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  std::atomic<std::int64_t> dropped_ = 0;
  std::atomic<bool> stopping_ = false;
  std::thread receiver_;
};

}  // namespace

std::int64_t WallClockUs() {
  using namespace std::chrono;
  return duration_cast<microseconds>(system_clock::now().time_since_epoch()).count();
}

std::int64_t SteadyClockUs() {
  using namespace std::chrono;
  return duration_cast<microseconds>(steady_clock::now().time_since_epoch()).count();
}

long GrantedReceiveBufferBytes() {
  long bytes = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> bytes;
  return bytes;
}

std::unique_ptr<Bus> OpenBus(const std::string& url, Clock clock) {
  if (!url.starts_with("udpm://") && !url.starts_with("memq://"))
    throw BusError("bus: " + url + " has to begin with udpm:// or memq://, as in udpm://239.255.76.67:7667?ttl=0");
  return std::make_unique<LcmBus>(url, std::move(clock));
}

std::string BusVersion() {
  return std::to_string(LCM_MAJOR_VERSION) + "." + std::to_string(LCM_MINOR_VERSION) + "." +
         std::to_string(LCM_MICRO_VERSION);
}

}  // namespace forereach
