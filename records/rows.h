/** What the database holds of a log, without SQL: made by the interpreter, written and read by the database. */
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "lcmtypes/grounds.h"

#include "lcmtypes/stream_order.h"

namespace forereach {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/** The event of the log that a row comes from: file and number together are unique in each table. */
struct LogReference {
  std::string log_file;  ///< File name without directory.
  std::int64_t event_number = -1;
  std::string digest;  ///< DigestOf the event, in hexadecimal; empty without an event, and in rows of schema version 1.
};

/** A decision_t in words. Digests in hexadecimal. */
struct DecisionRow {
  LogReference event;
  std::int64_t utime = 0, candidate_utime = 0, sequence = 0, plan_id = 0;
  std::string source, outcome, cause, message;
  int step = -1, coordinate = -1, obstacle = -1, first_observation = -1, second_observation = -1;
  double margin = kUnknown, threshold = kUnknown, elapsed_us = kUnknown;
  /** From the candidate's receipt to the decision's, both at the logger; unknown without a candidate in the log. */
  double latency_us = kUnknown;
  std::string plan_digest;
  std::array<std::string, kGrounds.size()> grounds;  ///< In the order of kGrounds.
};

/** An execution_event_t in words. */
struct EventRow {
  LogReference event;
  std::int64_t utime = 0, sequence = 0, plan_id = -1;
  std::string kind, message;
  int step = -1, coordinate = -1;
  std::vector<double> state;
  double value = kUnknown;
};

/** A gap: missing messages, or a restart of their sender. */
struct GapRow {
  LogReference event;  ///< The first message behind the gap; event_number -1 where there is none.
  std::string channel, source;
  std::int64_t expected = -1, got = -1;  ///< Sequence numbers, -1 where none applies.
  std::int64_t lost = 0;
  std::int64_t utime = 0;
  /** "bus": never arrived; "queue": arrived while the logger's queue was full; "restart": the sender began anew;
  "disk": could not be written, or too little was free; "quota": logger.quota_mb had no room for them;
  "gone": were in a log that was deleted, moved, replaced or cut short while it was written; "unsigned": more than
  logger.unsigned_kb_per_s, on channels that are not ForeReach's; "backlog":
  discarded by the bus before the logger took it, of any channel: those that count their messages show a gap "bus" too.
*/
  std::string reason;
};

struct Rows {
  std::vector<DecisionRow> decisions;
  std::vector<EventRow> events;
  std::vector<GapRow> gaps;

  [[nodiscard]] std::size_t size() const { return decisions.size() + events.size() + gaps.size(); }
  [[nodiscard]] bool empty() const { return size() == 0; }
};

}  // namespace forereach
