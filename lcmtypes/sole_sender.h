/** Who sends on a stream: is it one sender, or are two heard? It uses no bus and no clock.

A stream, for example OBSTACLES, has one sender. A second one under the same key, such as a process that was left
running, sends what may contradict the first. Sequence numbers cannot tell the two apart: of two senders at different
rates, the faster one looks like a stream in order. So a receiver goes by the sender id of the signature
(bus/authentic.h), which every process draws anew.

With t the stream's timeout, a sender is heard at `now` if a message of it came at or after now - t:

    The messages of one sender count. Another one takes its place with its first message that comes when the one before
    is not heard any more.
    WhyTwo        two senders are heard.
    WhyNotAlone   two senders are heard; or the one whose messages count has not been heard for longer than t without a
                  break. A second sender may not have been heard yet then.

So with senders that are never silent for t, a receiver for which WhyNotAlone is empty hears every sender that there is.
Without a signature there is no sender id: all messages are taken to be of one sender, and both texts are empty.

Times are those of arrival at the receiver, microseconds of one clock. When it is set back, what was heard later than
now is taken to have been heard now: a sender waits for t once more, and never for the time by which the clock went
back. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** Of a message's signature; nothing if it is not signed. */
using SenderId = std::optional<std::uint64_t>;

/** As in messages for people: 16 hexadecimal digits. */
[[nodiscard]] std::string SenderText(std::uint64_t sender_id);

class SoleSender final {
 public:
  /** Senders that are remembered, of those that are heard. More change nothing but the names in the texts. */
  static constexpr std::size_t kMost = 8;

  enum class Place {
    kGoesOn,     ///< Of the sender whose messages count.
    kTakesOver,  ///< The same, from now on: it is the first one, or the one before has fallen silent.
    kOther,      ///< Of another sender: it does not count.
  };

  /** @param timeout_us the stream's timeout, positive. */
  explicit SoleSender(std::int64_t timeout_us) : timeout_us_(timeout_us) {}

  /** Uses another timeout from now on. */
  void Follow(std::int64_t timeout_us) { timeout_us_ = timeout_us; }

  /** Notes an authentic message, whatever is in it. Cost O(kMost). */
  Place Hear(SenderId sender, std::int64_t now_us);

  /** "two senders are heard, 00000000000000aa and 00000000000000bb: one of them has to end"; empty if there are not. */
  [[nodiscard]] std::string WhyTwo(std::int64_t now_us) const;
  /** WhyTwo, or "sender 00000000000000aa has been heard for 120 ms; it counts after 1000 ms alone". Empty if neither,
  or nothing was heard. */
  [[nodiscard]] std::string WhyNotAlone(std::int64_t now_us) const;

  /** The sender whose messages count. */
  [[nodiscard]] SenderId counts() const { return heard_.empty() ? std::nullopt : SenderId(heard_.front().id); }

 private:
  struct Heard {
    std::uint64_t id;
    std::int64_t since_us, last_us;  // heard without a break from since_us on
  };

  [[nodiscard]] bool IsHeard(const Heard& sender, std::int64_t now_us) const;
  void SetBack(std::int64_t now_us);

  std::int64_t timeout_us_;
  std::vector<Heard> heard_;  // the first is the one whose messages count
};

}  // namespace forereach
