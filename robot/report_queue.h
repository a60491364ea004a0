/** Reports that wait to be sent: a bounded queue for each channel, which allocates nothing after its construction.

Send takes the oldest report first. A report is gone once `send` returns. If `send` throws, the report waits for the
next call of Send, and so do all later reports of its channel. If a queue is full, its oldest report is lost. Reports
carry the sequence number of their channel, so receivers see a gap for each lost one. */
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "forereach/execution_event_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

class ReportQueue final {
 public:
  static constexpr std::size_t kMostWaiting = 64;  ///< Reports of one channel.
  static constexpr std::size_t kChannels = 3;

  explicit ReportQueue(std::array<std::string, kChannels> names) {
    for (std::size_t i = 0; i < kChannels; ++i) channels_[i].name = std::move(names[i]);
  }

  /** Adds a report. @param channel the index of its name. */
  template <class Message>
  void Add(std::size_t channel, const Message& message) noexcept {
    static_assert(kMostBytes >= kFingerprintBytes + sizeof(Message));
    Channel& to = channels_[channel];
    if (to.count == kMostWaiting) {
      to.Pop();
      ++lost_;
    }
    Entry& entry = to.At(to.count++);
    entry.order = next_order_++;
    entry.size = static_cast<std::size_t>(message.getEncodedSize());
    message.encode(entry.bytes.data(), 0, static_cast<int>(kMostBytes));
  }

  /** Calls send(name, bytes) once for each report that waits now, except those behind one that failed. `send` may call
  Add, but not Send. */
  template <class SendFunction>
  void Send(SendFunction&& send) noexcept {
    std::array<bool, kChannels> failed{};
    for (std::size_t left = waiting(); left > 0; --left) {
      const std::size_t next = FindOldest(failed);
      if (next == kChannels) return;
      Channel& from = channels_[next];
      const Entry entry = from.At(0);  // a copy: `send` may add reports to a full queue
      try {
        send(from.name, Bytes(entry.bytes.data(), entry.size));
      } catch (...) {
        ++failures_;
        failed[next] = true;
        continue;
      }
      if (from.count > 0 && from.At(0).order == entry.order) from.Pop();
    }
  }

  [[nodiscard]] std::size_t waiting() const {
    std::size_t sum = 0;
    for (const Channel& channel : channels_) sum += channel.count;
    return sum;
  }
  [[nodiscard]] std::int64_t lost() const { return lost_; }
  [[nodiscard]] std::int64_t failures() const { return failures_; }  ///< Of `send`, repeated ones included.

 private:
  // The fields of a message need no more room encoded than in memory.
  static constexpr std::size_t kFingerprintBytes = 8;
  static constexpr std::size_t kMostBytes =
      kFingerprintBytes + std::max({sizeof(execution_event_t), sizeof(robot_state_t), sizeof(transition_t)});

  struct Entry {
    std::int64_t order = 0;  // of all channels together
    std::size_t size = 0;
    std::array<std::uint8_t, kMostBytes> bytes;
  };
  struct Channel {
    std::string name;
    std::vector<Entry> ring = std::vector<Entry>(kMostWaiting);
    std::size_t first = 0, count = 0;

    [[nodiscard]] Entry& At(std::size_t i) { return ring[(first + i) % kMostWaiting]; }
    void Pop() {
      first = (first + 1) % kMostWaiting;
      --count;
    }
  };

  // The channel with the oldest report that may be sent; kChannels if there is none.
  [[nodiscard]] std::size_t FindOldest(const std::array<bool, kChannels>& failed) {
    std::size_t oldest = kChannels;
    for (std::size_t i = 0; i < kChannels; ++i)
      if (!failed[i] && channels_[i].count > 0 &&
          (oldest == kChannels || channels_[i].At(0).order < channels_[oldest].At(0).order))
        oldest = i;
    return oldest;
  }

  std::array<Channel, kChannels> channels_;
  std::int64_t next_order_ = 0, lost_ = 0, failures_ = 0;
};

}  // namespace forereach
