/** Checks a logger's directory: whether the logs have every event from which a row of the database was made. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "lcmtypes/bad_input.h"
#include "records/event_log.h"

namespace forereach {

/** The result for one log file: its events from which rows of the database were made. */
struct LogCheck {
  std::string log_file{};
  /** kDeleted: the logger deleted it for the quota, which is not a fault. kUnknown: the database has no run for it. */
  enum class Log { kThere, kMissing, kDeleted, kUnknown } log = Log::kThere;
  bool ended = true;
  std::int64_t whole = 0;               ///< Events that the log has with the digest of the row.
  std::vector<std::int64_t> changed{};  ///< Numbers of events for which the log has a different event.
  std::vector<std::int64_t> missing{};  ///< Numbers of events that the log lacks; all of them if there is no log.
  LogDamage damage{};                   ///< Of the log.
  std::int64_t cut_bytes = 0;           ///< Bytes behind the last whole record.

  std::vector<std::string> damaged_tasks{};  ///< A sentence for each damaged kept task that its decisions name.

  /** True if nothing is changed or damaged, and nothing is missing except for the quota. */
  [[nodiscard]] bool whole_log() const;
};

/** Checks every log that the database in `directory` lists, in the order of its runs. Behind them come logs with a
logger's name that it does not list. A log that is being written may end in a cut tail, which is not a fault. Cost: one
pass over each listed log. @throws BadInput if the database is missing, or it or a log cannot be read. */
[[nodiscard]] std::vector<LogCheck> CheckLogs(const std::string& directory);

/** Text for people: a line for each log file, a line for each changed or missing event, and a total. */
[[nodiscard]] std::string ToText(const std::vector<LogCheck>& checks);
[[nodiscard]] nlohmann::json ToJson(const std::vector<LogCheck>& checks);

}  // namespace forereach
