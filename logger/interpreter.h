/** Turns what the bus carried, in the order of the log, into database rows. No file, no SQL, no clock: the same events
give the same rows, live and when a log is read again. */
#pragma once

#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "certifier/task/config.h"
#include "lcmtypes/codec.h"
#include "logger/event_log.h"
#include "logger/rows.h"

namespace forereach {

/** Messages that share one sequence count: those of a channel, on the candidates' channel those of one source. */
struct Stream {
  std::string channel, source;
  auto operator<=>(const Stream&) const = default;
};

class Interpreter final {
 public:
  Interpreter(BusOptions channels, std::string log_file);

  /** The stream of a message, and its sequence number if it is one of a type that counts them. */
  [[nodiscard]] std::pair<Stream, std::optional<std::int64_t>> Identify(const std::string& channel, Bytes bytes) const;

  /** The next event is the first of another file, which goes on where this one ends. */
  void Continue(std::string log_file) { log_file_ = std::move(log_file); }

  /** Adds the rows that the next event of the log gives. */
  void Observe(const LogEvent& event, Rows& rows);

  /** `lost` messages of the stream, the next ones of its count, are accounted for already: they make no second gap. */
  void Forgive(const Stream& stream, std::int64_t lost);

 private:
  static constexpr std::size_t kMaxStreams = 1024;     // a sender that invents sources must not fill the memory
  static constexpr std::size_t kMaxCandidates = 1024;  // undecided

  struct Count {
    std::optional<std::int64_t> next;
    std::int64_t forgiven = 0;
  };

  [[nodiscard]] std::optional<GapRow> CheckSequence(const LogEvent& event);  // without its event
  [[nodiscard]] double LatencyUs(const Digest& plan, std::int64_t utime);

  BusOptions channels_;
  std::string log_file_;
  std::map<Stream, Count> streams_;
  std::deque<std::pair<Digest, std::int64_t>> candidates_;  // received and not yet decided
};

}  // namespace forereach
