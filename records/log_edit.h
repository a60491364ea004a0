/** Chooses events of logs and writes them to a new log, for `forereach log`. Messages are recognised by their types, so
no task is needed. Signatures are kept and not checked. */
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "records/event_log.h"
#include "records/message_json.h"

namespace forereach {

/** A time of a log in microseconds since the Unix epoch: "1767268800000000", "2026-01-01T12:00:00.5" (UTC, with or
without a final Z), or "+12.5", seconds after the first event of the logs.
@param first_utime of the first event. @throws LogError for another text. */
[[nodiscard]] std::int64_t ParseLogTime(const std::string& text, std::int64_t first_utime);

struct LogSelection {
  std::string from, to;                 ///< As for ParseLogTime; from <= event < to. Empty: no bound.
  std::vector<std::string> channels{};  ///< Empty: all.
  /** The name of an outcome: candidates, decisions and certified plans only of plans that were decided so, by the next
  decision on the plan within 64 MiB or by one before. Empty: all. */
  std::string outcome;
  bool drops_others = false;  ///< With an outcome: messages that are not about a plan, too.
};

/** Bytes of a log that are no record, or the beginning of one at its end. */
struct DamagedPlace {
  std::string log;
  std::int64_t offset = 0, bytes = 0;
  bool is_cut = false;  ///< At the end: the log's writer was killed, or is still writing.
};

struct LogUser {
  /** @param summary nothing for a message of another type. */
  std::function<void(const LogEvent&, const std::optional<MessageSummary>& summary, const std::string& log)> on_event;
  std::function<void(const DamagedPlace&)> on_damage;
};

struct LogEditResult {
  std::int64_t events = 0, chosen = 0;
  LogDamage damage;  ///< Without cut ends.
  std::int64_t cut_ends = 0;
  /** Names of channels, at most kMostChannels. */
  std::set<std::string> channels = {};

  static constexpr std::size_t kMostChannels = 64;
};

enum class LogSequence { kAsNamed, kByTime };

/** Reads logs, one behind the other or merged by time. Merged events of one log keep their order, also where its clock
went back. Memory: one event of each log that is open; with an outcome 32 bytes for each plan with it, and at most
64 MiB of events from the first whose plan is not decided.
@throws LogError if a log cannot be read, is named twice or is of another kind; if a time cannot be read; at the end, if
no event has a channel that was chosen. */
[[nodiscard]] LogEditResult ReadLogs(const std::vector<std::string>& logs, const LogSelection& selection,
                                     LogSequence sequence, const LogUser& user);

/** The same, into a new log. Stamps and bytes stay as they are. Event numbers stay if they come from one log; those of
several logs are counted anew from 0.
@throws BadInput also if the output exists or cannot be written; then no output is left behind. */
[[nodiscard]] LogEditResult WriteLog(const std::vector<std::string>& logs, const LogSelection& selection,
                                     LogSequence sequence, const std::string& output,
                                     const std::function<void(const DamagedPlace&)>& on_damage);

}  // namespace forereach
