/** The publish-subscribe bus that nodes use. Only the implementation of OpenBus uses LCM.

Handlers run in the thread that calls Dispatch, never in the receive thread, so a node needs no locks. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus/authentic.h"
#include "bus/bus_url.h"
#include "bus/clock.h"
#include "bus/datagram.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/sole_sender.h"

namespace forereach {

struct Received {
  const std::string& channel;
  Bytes bytes;           ///< The message that the screen admitted; empty if it was refused.
  std::int64_t utime;    ///< Time of arrival, microseconds since the Unix epoch.
  Bytes raw;             ///< The bytes as they arrived, with the trailer if there is one.
  SenderId sender = {};  ///< Of the signature that the screen has verified; nothing if it verified none.
};

/** Decides which messages a bus admits, and signs those that it sends. */
class Screen {
 public:
  virtual ~Screen() = default;

  /** Called once for each message with a subscription, in the order of arrival, before the message enters the queue. On
  a udpm bus the receive thread calls it, on memq the thread that calls Dispatch. If it throws, the message is lost and
  counted as dropped.
  @return the message, a subspan of `raw`; nothing if it is refused. */
  [[nodiscard]] virtual std::optional<Bytes> Admit(const std::string& channel, Bytes raw) = 0;

  /** The bytes to send for a message; nothing if it must not be sent. Any thread may call it. */
  [[nodiscard]] virtual std::optional<std::vector<std::uint8_t>> ToSend(const std::string& /*channel*/, Bytes message) {
    return std::vector(message.begin(), message.end());
  }

  /** Bus::refusals. Any thread may call it. */
  [[nodiscard]] virtual Refusals refusals() const { return {}; }
};

class Bus {
 public:
  using Handler = std::function<void(const Received&)>;
  static constexpr const char* kEveryChannel = ".*";

  virtual ~Bus() = default;

  /** Calls `handler` for each admitted message on this channel, or on every channel (kEveryChannel). */
  virtual void Subscribe(const std::string& channel, Handler handler) = 0;

  /** Like Subscribe, but calls `handler` also for refused messages, which have only `raw`. The logger uses it, and
  receivers that check messages themselves. Refused messages wait in a separate queue, so that they displace no admitted
  ones. */
  virtual void SubscribeUnchecked(const std::string& channel, Handler handler) {
    Subscribe(channel, std::move(handler));
  }

  /** Sends a message. Returns false if the bus refuses it, for example if it does not fit one datagram
  (bus/datagram.h). Any thread may call it. */
  virtual bool Publish(const std::string& channel, Bytes bytes) = 0;

  /** Calls the handlers of all messages that have arrived; waits up to `timeout_ms` milliseconds for the first one.
  Returns the number of handler calls. If a handler throws, only that message is lost: the exception reaches the caller,
  and the bus stays usable. */
  virtual int Dispatch(int timeout_ms) = 0;

  /** True if Dispatch would call a handler of an admitted message at once. False also if the bus cannot tell. */
  [[nodiscard]] virtual bool has_waiting() const { return false; }

  /** The number of messages that were discarded because the queue (4096 messages or 32 MiB) was full, plus the number
  of datagrams that the kernel discarded because its receive buffer was full. */
  [[nodiscard]] virtual std::int64_t dropped() const = 0;

  /** The number of refused messages for SubscribeUnchecked that were discarded because their queue (256 messages or 4
  MiB) was full. */
  [[nodiscard]] virtual std::int64_t refused_dropped() const { return 0; }

  /** Refused messages by reason, on a signed bus. */
  [[nodiscard]] virtual Refusals refusals() const { return {}; }

  /** Received datagrams by kind. All zero on memq. */
  [[nodiscard]] virtual DatagramCounts datagrams() const { return {}; }

  template <class Message>
  bool Publish(const std::string& channel, const Message& message) {
    return Publish(channel, Bytes(Encode(message)));
  }
};

/** Opens an LCM bus: `udpm://239.255.76.67:7667?ttl=0`, or `memq://`, which exists only inside this object.

A udpm bus sends with LCM and receives with its own receiver, on a thread that only checks headers, calls the screen and
copies messages (bus/udp_receiver.h). Datagrams that are not a whole message are counted and discarded. A memq bus
delivers within Dispatch, in order, stamped by `clock`, so several nodes in one process can run on a simulated clock.
@param screen null: every message is admitted.
@throws BusError for any other kind of URL, or if the bus cannot be opened, for example without a multicast route. It
never falls back to another bus. */
[[nodiscard]] std::unique_ptr<Bus> OpenBus(const std::string& url, Clock clock = WallClockUs,
                                           const std::shared_ptr<Screen>& screen = nullptr);

/** The version of LCM in use, for example "1.3.1". */
[[nodiscard]] std::string BusVersion();

}  // namespace forereach
