/** A publish-subscribe bus as the nodes see it. Only the implementation of OpenBus knows LCM.

Handlers run in the thread that calls Dispatch, never in a receive thread, so a node needs no locks. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "lcmtypes/authentic.h"
#include "lcmtypes/bad_input.h"
#include "lcmtypes/codec.h"

namespace forereach {

/** Microseconds since the Unix epoch. */
using Clock = std::function<std::int64_t()>;
[[nodiscard]] std::int64_t WallClockUs();
/** Microseconds since some time, by a clock that nobody sets. */
[[nodiscard]] std::int64_t SteadyClockUs();

/** The bus cannot be opened; the text says what to do about it. */
class BusError : public BadInput {
 public:
  using BadInput::BadInput;
};

struct Received {
  const std::string& channel;
  Bytes bytes;
  std::int64_t utime;  ///< Microseconds since the Unix epoch at which it arrived here.
};

class Bus {
 public:
  using Handler = std::function<void(const Received&)>;

  virtual ~Bus() = default;

  /** Calls `handler` for each message on a channel that matches the regular expression as a whole. */
  virtual void Subscribe(const std::string& channel, Handler handler) = 0;

  /** The same, but hands out messages as they came, signature and all, on a bus that else takes authentic ones only
  (authentic_bus.h): for who records, or checks by itself. */
  virtual void SubscribeUnchecked(const std::string& channel, Handler handler) { Subscribe(channel, std::move(handler)); }

  /** Sends; returns false if the bus refused. May be called from any thread. */
  virtual bool Publish(const std::string& channel, Bytes bytes) = 0;

  /** Hands out what has arrived; waits up to `timeout_ms` for the first message. Returns how many it handed out.
  A handler that throws loses that message only: the exception reaches the caller, the bus stays usable. */
  virtual int Dispatch(int timeout_ms) = 0;

  /** Messages discarded here because more than the bounded queue holds, 4096 or 32 MiB, had arrived undispatched. */
  [[nodiscard]] virtual std::int64_t dropped() const = 0;

  /** Messages that were not authentic, on a bus that looks. */
  [[nodiscard]] virtual Refusals refusals() const { return {}; }

  template <class Message>
  bool Publish(const std::string& channel, const Message& message) {
    return Publish(channel, Bytes(Encode(message)));
  }
};

/** Opens an LCM bus: `udpm://239.255.76.67:7667?ttl=0`, or `memq://`, which lives inside this object alone.
A udpm bus asks for a receive buffer of 2 MB, unless the URL says recv_buf_size, and receives on a thread that only
copies messages out; memq delivers within Dispatch, in order, stamped by `clock`, so that several nodes in one process
can run on a simulated one.
@throws BusError for any other kind of URL, or if LCM cannot open it, for example without a multicast route; never falls
back to another bus. */
[[nodiscard]] std::unique_ptr<Bus> OpenBus(const std::string& url, Clock clock = WallClockUs);

/** What a udpm bus asks for: Debian's default, 208 kB, holds four certified plans. */
inline constexpr long kReceiveBufferBytes = long{2} << 20;

/** The largest receive buffer that the kernel grants; 0 if it does not say. */
[[nodiscard]] long GrantedReceiveBufferBytes();

/** The version of LCM in use, as "1.3.1". */
[[nodiscard]] std::string BusVersion();

}  // namespace forereach
