/** The received messages of a bus that wait for dispatch: subscriptions, the screen, and two bounded queues. */
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "bus/bus.h"

namespace forereach {

class Inbox final {
 public:
  /** @param screen null: every message is admitted. */
  explicit Inbox(std::shared_ptr<Screen> screen) : screen_(std::move(screen)) {}

  /** As Bus::Subscribe and, with `unchecked`, Bus::SubscribeUnchecked. */
  void Subscribe(const std::string& channel, Bus::Handler handler, bool unchecked);

  /** Stores a message if there is a subscription for it. Only one thread at a time may call it. */
  void Put(std::string_view channel, Bytes raw, std::int64_t utime) noexcept;

  /** As Bus::Dispatch, for the stored messages. */
  int HandOut(int timeout_ms);

  /** True if an admitted message is stored. Any thread may call it. */
  [[nodiscard]] bool has_waiting() const;

  /** Returns freed heap to the system once a burst has been dispatched. This takes some milliseconds, so call it when
  the process is idle, on the thread that calls HandOut. */
  void GiveBack();

  [[nodiscard]] std::int64_t dropped() const { return admitted_.dropped; }
  [[nodiscard]] std::int64_t refused_dropped() const { return refused_.dropped; }

 private:
  struct Subscription {
    std::string channel;
    Bus::Handler handler;
    bool unchecked;
  };
  using Subscriptions = std::vector<const Subscription*>;
  struct Stored {
    std::uint64_t number;  // in the order of arrival
    std::string channel;
    std::vector<std::uint8_t> raw;
    std::size_t message_begin, message_bytes;  // inside raw
    std::int64_t utime;
    SenderId sender;
    Subscriptions for_whom;
  };
  struct Queue {
    const std::size_t max_messages, max_bytes;
    std::deque<Stored> messages = {};
    std::size_t bytes = 0;
    std::atomic<std::int64_t> dropped = 0;

    void Push(Stored stored);
  };

  [[nodiscard]] Subscriptions Wanting(std::string_view channel);

  const std::shared_ptr<Screen> screen_;
  mutable std::mutex mutex_;  // guards subscriptions_, the queues and next_number_
  std::condition_variable arrived_;
  std::deque<Subscription> subscriptions_;       // only grows, so pointers into it stay valid
  Queue admitted_{4096, std::size_t{32} << 20};  // 800 certified plans
  Queue refused_{256, std::size_t{4} << 20};
  std::uint64_t next_number_ = 0;
  bool was_in_burst_ = false, is_in_burst_ = false;  // used only by the thread that calls HandOut
};

}  // namespace forereach
