/** The order of a sender's messages: is this one newer than those before, a repetition, late, or of a restarted sender?

Every type on the bus that counts has a `sequence`, from 0 for each sender and channel (of candidates: for each source),
and a stamp, `utime`. Compare answers by both. With n the newest message taken, u the latest stamp taken since the
sender began (each at most the horizon at its arrival), z the stamp of the last message 0 taken, and p a message that
arrives at horizon h:

    kNewer      no message was taken before, or p.sequence > n.sequence
    kRepeated   p == n, or p.sequence == 0 and p.utime == z
    kRestarted  none of these, and min(p.utime, h) > u or u > h
    kRewound    none of these, and p.sequence == 0
    kLate       none of these

A restarted sender is recognised by a later stamp. Where u > h the receiver's clock was set back, and stamps tell no
order. kRewound is ambiguous: the sender restarted and its clock was set back, or others overtook the first message. A
receiver that acts on messages ignores it, so that an older message never replaces a newer one; it accepts the stream
again once the stamps or the count have caught up. A reader of records treats it as a restart.

A restart with a clock that was set back, whose message 0 is lost, is kLate until the count or the stamps catch up. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** A message's own count and stamp (microseconds since the Unix epoch). */
struct StreamPosition {
  std::int64_t sequence, utime;
  friend bool operator==(const StreamPosition&, const StreamPosition&) = default;
};

enum class Succession { kNewer, kRepeated, kLate, kRestarted, kRewound };

/** Whether a receiver that acts on messages takes it. */
[[nodiscard]] constexpr bool IsNews(Succession succession) {
  return succession == Succession::kNewer || succession == Succession::kRestarted;
}

class StreamOrder final {
 public:
  /** For receivers without a clock: stamps are not limited. */
  static constexpr std::int64_t kNoHorizon = std::numeric_limits<std::int64_t>::max();

  /** The latest stamp that a message can have at time now_us, if the sender's clock is ahead by at most max_ahead_us >=
  0. A later stamp is treated as this one, so that no message stays the latest for ever. */
  [[nodiscard]] static constexpr std::int64_t Horizon(std::int64_t now_us, std::int64_t max_ahead_us) {
    return now_us > kNoHorizon - max_ahead_us ? kNoHorizon : now_us + max_ahead_us;
  }

  /** Classifies a message by the table above. All numbers are valid. Cost O(1). */
  [[nodiscard]] Succession Compare(const StreamPosition& message, std::int64_t horizon_us) const {
    if (!newest_ || message == *newest_) return newest_ ? Succession::kRepeated : Succession::kNewer;
    if (message.sequence > newest_->sequence) return Succession::kNewer;
    if (message.sequence == 0 && message.utime == begun_utime_) return Succession::kRepeated;
    if (std::min(message.utime, horizon_us) > latest_utime_ || latest_utime_ > horizon_us)
      return Succession::kRestarted;
    return message.sequence == 0 ? Succession::kRewound : Succession::kLate;
  }

  /** Takes the message as the newest one. If its sequence is not larger than the last one, its sender has restarted. */
  void Take(const StreamPosition& message, std::int64_t horizon_us) {
    const std::int64_t utime = std::min(message.utime, horizon_us);
    const bool goes_on = newest_ && message.sequence > newest_->sequence;
    latest_utime_ = goes_on ? std::max(latest_utime_, utime) : utime;
    if (message.sequence == 0) begun_utime_ = message.utime;
    newest_ = message;
  }

  /** The message taken last; nothing before the first. */
  [[nodiscard]] const std::optional<StreamPosition>& newest() const { return newest_; }

 private:
  std::optional<StreamPosition> newest_;
  std::int64_t latest_utime_ = 0;
  std::optional<std::int64_t> begun_utime_;  // of the last message 0
};

/** The sum of two counts of lost messages; a negative count is taken as 0. A sender can send any sequence number, so
the sum saturates at the largest number. */
[[nodiscard]] constexpr std::int64_t SumOfLost(std::int64_t a, std::int64_t b) {
  const std::int64_t more = std::max<std::int64_t>(b, 0);
  return a > std::numeric_limits<std::int64_t>::max() - more ? std::numeric_limits<std::int64_t>::max() : a + more;
}

}  // namespace forereach
