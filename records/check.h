/** Holds a logger's directory against itself: the events that the database's rows come from against the logs. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "lcmtypes/bad_input.h"
#include "records/event_log.h"

namespace forereach {

/** What became of the events of one log file that rows of the database come from. */
struct LogCheck {
  std::string log_file{};
  /** kDeleted: for the quota, which is no fault. kUnknown: no run of the database is its. */
  enum class Log { kThere, kMissing, kDeleted, kUnknown } log = Log::kThere;
  bool ended = true;
  std::int64_t whole = 0;               ///< The log has the event, and its digest is the row's.
  std::int64_t unchecked = 0;           ///< The log has it, but the row is older than digests.
  std::vector<std::int64_t> changed{};  ///< Event numbers: the log has another event of this number.
  std::vector<std::int64_t> missing{};  ///< Event numbers: the log has none; all, where it is not there.
  LogDamage damage{};                   ///< Of the log.
  std::int64_t cut_bytes = 0;           ///< Behind the last whole record.

  std::vector<std::string> damaged_tasks{};  ///< One sentence each, of the kept tasks that its decisions name.

  /** Nothing is changed, missing but for the quota, or damaged. */
  [[nodiscard]] bool whole_log() const;
};

/** Checks every log that the database in `directory` knows, in the order of the runs, and lists behind them those that
are named like a logger's and that it does not know. Cost: one pass over each log it knows.
A log that is being written may end in a cut tail, which is no fault of it.
@throws BadInput if there is no database, it cannot be read, or a log cannot be. */
[[nodiscard]] std::vector<LogCheck> CheckLogs(const std::string& directory);

/** Lines for a person: one for each log file, one for each event that is changed or missing, and a sum. */
[[nodiscard]] std::string ToText(const std::vector<LogCheck>& checks);
[[nodiscard]] nlohmann::json ToJson(const std::vector<LogCheck>& checks);

}  // namespace forereach
