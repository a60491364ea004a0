/** Makes database rows from messages in the order of the log. It uses no file, SQL or clock, so the same events give
the same rows, live and when a log is read again.

**Sequence numbers** (StreamOrder). A message ahead of its stream's count makes a gap "bus". A late or repeated one
makes none. A sender that restarted makes a gap "restart". A late message that a gap has counted as lost stays counted.

With a key, messages that are not authentic (LogAuthenticator) make no rows and do not count. */
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "bus/authentic.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/stream_order.h"
#include "records/event_log.h"
#include "records/log_trust.h"
#include "records/rows.h"
#include "records/undecided.h"
#include "task/config.h"

namespace forereach {

/** The messages that share one sequence count: those of a channel, or of one source on the candidates' channel. */
struct Stream {
  std::string channel, source;
  auto operator<=>(const Stream&) const = default;
};

class Interpreter final {
 public:
  /** @param keys as LogAuthenticator's. */
  Interpreter(BusOptions channels, std::string log_file, std::optional<KeyRing> keys = {});

  /** The stream of a message, and its position if its type has a sequence number. */
  [[nodiscard]] std::pair<Stream, std::optional<StreamPosition>> Identify(const std::string& channel,
                                                                          Bytes bytes) const;

  /** The next event is the first of the next file of the same run. */
  void Continue(std::string log_file) { log_file_ = std::move(log_file); }

  /** Adds the rows made from the next event of the log. */
  void Observe(const LogEvent& event, Rows& rows);

  /** The next `lost` sequence numbers of the stream are already in a gap; they make no second one. */
  void Forgive(const Stream& stream, std::int64_t lost);

  /** Messages that were not authentic. */
  [[nodiscard]] Refusals refusals() const { return authenticator_.refusals(); }

 private:
  static constexpr std::size_t kMaxStreams = 1024;     // a sender that invents sources must not fill the memory
  static constexpr std::size_t kMaxCandidates = 1024;  // undecided

  struct Count {
    StreamOrder order;
    std::int64_t forgiven = 0;
  };

  [[nodiscard]] std::optional<GapRow> CheckSequence(const LogEvent& event);  // without its event
  [[nodiscard]] double LatencyUs(const decision_t& decision, std::int64_t utime);

  BusOptions channels_;
  std::string log_file_;
  LogAuthenticator authenticator_;
  std::map<Stream, Count> streams_;
  Undecided<std::int64_t> candidates_{kMaxCandidates};  // when each was received
  int shadow_ = -1;                                     // of the last heartbeat of the certifier in charge
};

}  // namespace forereach
