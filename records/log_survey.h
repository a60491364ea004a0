/** Determines the kind of a file, and whether logs belong to one run, from the ends of the logs. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/codec.h"
#include "records/event_log.h"

namespace forereach {

/** What tells whether one log continues another: sequence numbers of heartbeats. */
struct LogEnds {
  struct Range {
    std::optional<std::int64_t> first, last;
    void Take(std::int64_t value);
  };
  Range utime;              ///< Of all events.
  Range certifier, logger;  ///< Sequence numbers of heartbeats.

  /** These ends, extended by those of the log behind. */
  void Extend(const LogEnds& behind);
};

/** A sender without a heartbeat among these first bytes of a log does not tell whether the log goes on from another. */
inline constexpr std::int64_t kEndBytes = 4 << 20;

/** Reads the beginning of a log until the heartbeats, and its end as far as they are there.
@throws BadInput if the file is not an event log. */
[[nodiscard]] LogEnds EndsOf(const std::string& log);

/** Whether the heartbeats of certifier or logger go on from one to the other. Nothing if no heartbeats tell. */
[[nodiscard]] std::optional<bool> Continues(const LogEnds& before, const LogEnds& log);

/** @throws BadInput if a file is not an event log, or is named twice; the text says what it is. */
void RequireLogs(const std::vector<std::string>& logs);

/** The kind of a file, by its first bytes. */
enum class FileKind { kDirectory, kEmpty, kEventLog, kDatabase, kJson, kOther };

/** @throws LogError if the file cannot be read. */
[[nodiscard]] FileKind KindOf(const std::string& path);

}  // namespace forereach
