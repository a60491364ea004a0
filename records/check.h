/** Checks a logger's directory: whether the logs have every event from which a row of the database was made, and the
database the rows that follow from the events. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "lcmtypes/bad_input.h"
#include "records/event_log.h"
#include "records/log_trust.h"

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

  std::vector<std::string> rows{};           ///< A sentence for each row that differs (records/row_check.h).
  std::vector<std::string> damaged_tasks{};  ///< A sentence for each damaged kept task that its decisions name.

  /** True if nothing is changed or damaged, and nothing is missing except for the quota. */
  [[nodiscard]] bool whole_log() const;
};

/** Checks every log that the database in `directory` lists, in the order of its runs. Behind them come logs with a
logger's name, and logs of rows, that it does not list. A log that is being written may end in a cut tail, which is not
a fault. Cost: two passes over each listed log.
@param config the task file of the recording; empty: the one that the logger kept, or the default channels.
@param key for the runs whose logger had keys.
@throws BadInput if the database is missing, it or a log cannot be read, or a recording with keys is given none. */
[[nodiscard]] std::vector<LogCheck> CheckLogs(const std::string& directory, const std::string& config = "",
                                              const LogKey& key = {});

/** Text for people: a line for each log file, a line for each changed or missing event, and a total. */
[[nodiscard]] std::string ToText(const std::vector<LogCheck>& checks);
[[nodiscard]] nlohmann::json ToJson(const std::vector<LogCheck>& checks);

}  // namespace forereach
