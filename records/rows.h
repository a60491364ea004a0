/** The rows of the database, without SQL. The interpreter makes them; the database writes and reads them. */
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "lcmtypes/grounds.h"

#include "lcmtypes/stream_order.h"

namespace forereach {

inline constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

/** The event of the log from which a row was made. File and number together are unique in each table. */
struct LogReference {
  std::string log_file;  ///< File name without directory.
  std::int64_t event_number = -1;
  std::string digest;      ///< DigestOf the event, in hexadecimal; empty without an event.
  std::int64_t utime = 0;  ///< The event's own time in the log; without an event that of the row.
};

/** A decision_t with names in place of codes, and digests in hexadecimal. */
struct DecisionRow {
  LogReference event;
  std::int64_t utime = 0, candidate_utime = 0, sequence = 0, plan_id = 0;
  std::string source, outcome, cause, message;
  int step = -1, coordinate = -1, obstacle = -1, first_observation = -1, second_observation = -1;
  double margin = kNoNumber, threshold = kNoNumber, elapsed_us = kNoNumber;
  /** The time between the receipts of candidate and decision at the logger. Unknown if the log lacks the candidate. */
  double latency_us = kNoNumber;
  int shadow = -1;  ///< 1 or 0: whether it was made in shadow mode, by itself or the last heartbeat; -1: not known.
  std::string plan_digest;
  std::array<std::string, kGrounds.size()> grounds;  ///< In the order of kGrounds.
};

/** An execution_event_t with names in place of codes. */
struct EventRow {
  LogReference event;
  std::int64_t utime = 0, sequence = 0, plan_id = -1;
  std::string kind, message;
  int step = -1, coordinate = -1;
  std::vector<double> state;
  double value = kNoNumber;
};

/** A transition_t: an executed step. */
struct TransitionRow {
  LogReference event;
  std::int64_t utime = 0, sequence = 0, duration_us = 0;
  std::vector<double> state, input, next_state;
};

/** A gap in a stream: missing messages, or a restart of their sender. */
struct GapRow {
  LogReference event;  ///< The first message behind the gap; event_number is -1 if there is none.
  std::string channel, source;
  std::int64_t expected = -1, got = -1;  ///< Sequence numbers; -1 if none applies.
  std::int64_t lost = 0;
  std::int64_t utime = 0;
  /** The reason of the loss:
  - "bus": the messages did not arrive;
  - "queue": the logger's queue was full;
  - "restart": the sender restarted;
  - "disk": writing failed, or the disk had too little free space;
  - "quota": logger.quota_mb left no room;
  - "gone": the log was deleted, moved, replaced or cut while it was written;
  - "unsigned": the messages exceeded logger.unsigned_kb_per_s on channels that are not ForeReach's;
  - "backlog": the bus discarded messages of any channel before the logger took them. Streams with sequence numbers show
    these losses in a gap "bus" too. */
  std::string reason;
};

struct Rows {
  std::vector<DecisionRow> decisions;
  std::vector<EventRow> events;
  std::vector<GapRow> gaps;
  std::vector<TransitionRow> transitions;

  /** Calls visit(its name, the member with its rows) for each table. */
  static void ForEachTable(const auto& visit) {
    visit("decisions", &Rows::decisions);
    visit("execution_events", &Rows::events);
    visit("gaps", &Rows::gaps);
    visit("transitions", &Rows::transitions);
  }

  [[nodiscard]] std::size_t size() const { return decisions.size() + events.size() + gaps.size() + transitions.size(); }
  [[nodiscard]] bool empty() const { return size() == 0; }
};

/** The numbers of rows of one log file. */
struct RowCounts {
  std::int64_t decisions = 0, events = 0, gaps = 0, transitions = 0;
  bool operator==(const RowCounts&) const = default;
};

}  // namespace forereach
