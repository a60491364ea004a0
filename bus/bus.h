/** A publish-subscribe bus as the nodes see it. Only the implementation of OpenBus knows LCM.

Handlers run in the thread that calls Dispatch, never in a receive thread, so a node needs no locks. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "bus/authentic.h"
#include "bus/bus_url.h"
#include "bus/clock.h"
#include "bus/datagram.h"
#include "lcmtypes/codec.h"

namespace forereach {

struct Received {
  const std::string& channel;
  Bytes bytes;         ///< The message, which the screen admitted; empty if it was refused.
  std::int64_t utime;  ///< Microseconds since the Unix epoch at which it arrived here.
  Bytes raw;           ///< As it came, with its signature if it has one.
};

/** Decides which messages a bus takes. */
class Screen {
 public:
  virtual ~Screen() = default;

  /** Called once for each message that some subscription wants, in the order of arrival, before the message takes room
  in the queue. On a udpm bus the receiving thread calls it, on memq the thread that calls Dispatch. A message for which
  it throws is lost and counted as dropped.
  @return the message inside `raw`, a part of these very bytes; nothing if it is refused. */
  [[nodiscard]] virtual std::optional<Bytes> Admit(const std::string& channel, Bytes raw) = 0;
};

class Bus {
 public:
  using Handler = std::function<void(const Received&)>;
  static constexpr const char* kEveryChannel = ".*";

  virtual ~Bus() = default;

  /** Calls `handler` for each message on this channel, or on every channel (kEveryChannel), that the screen admits. */
  virtual void Subscribe(const std::string& channel, Handler handler) = 0;

  /** Calls `handler` for what is refused too, which then has `raw` alone: for who records, or checks by itself. Refused
  messages wait in a queue of their own, so that they displace no others. */
  virtual void SubscribeUnchecked(const std::string& channel, Handler handler) {
    Subscribe(channel, std::move(handler));
  }

  /** Sends; returns false if the bus refused, also a message that does not fit one datagram (bus/datagram.h),
  which nobody would receive. May be called from any thread. */
  virtual bool Publish(const std::string& channel, Bytes bytes) = 0;

  /** Hands out what has arrived; waits up to `timeout_ms` for the first message. Returns how many handlers it called.
  A handler that throws loses that message only: the exception reaches the caller, the bus stays usable. */
  virtual int Dispatch(int timeout_ms) = 0;

  /** Messages discarded here because more than the bounded queue holds, 4096 or 32 MiB, had arrived undispatched; and
  datagrams that the kernel discarded because its receive buffer was full. */
  [[nodiscard]] virtual std::int64_t dropped() const = 0;

  /** Refused messages that somebody wanted unchecked and that their own queue, 256 or 4 MiB, could not hold. */
  [[nodiscard]] virtual std::int64_t refused_dropped() const { return 0; }

  /** Messages that were not authentic, on a bus that looks. */
  [[nodiscard]] virtual Refusals refusals() const { return {}; }

  /** What arrived from the network, and what of it was no message. All zero on memq. */
  [[nodiscard]] virtual DatagramCounts datagrams() const { return {}; }

  template <class Message>
  bool Publish(const std::string& channel, const Message& message) {
    return Publish(channel, Bytes(Encode(message)));
  }
};

/** Opens an LCM bus: `udpm://239.255.76.67:7667?ttl=0`, or `memq://`, which lives inside this object alone.

A udpm bus sends by LCM and receives by itself, on a thread that only looks at headers, asks the screen and copies
messages out (bus/udp_receiver.h); datagrams that are no whole message are counted and go no further. memq delivers
within Dispatch, in order, stamped by `clock`, so that several nodes in one process can run on a simulated one.
@param screen null: every message is admitted.
@throws BusError for any other kind of URL, or if the bus cannot be opened, for example without a multicast route; never
falls back to another bus. */
[[nodiscard]] std::unique_ptr<Bus> OpenBus(const std::string& url, Clock clock = WallClockUs,
                                           std::shared_ptr<Screen> screen = nullptr);

/** The version of LCM in use, as "1.3.1". */
[[nodiscard]] std::string BusVersion();

}  // namespace forereach
