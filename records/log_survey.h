/** Determines the kind of a file, and whether logs belong to one run. */
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "lcmtypes/codec.h"
#include "records/event_log.h"

namespace forereach {

/** The content of logs for any names of channels: messages are recognised by their types. */
struct LogSurvey {
  static constexpr std::size_t kMaxConfigs = 256;  ///< Limits the memory that invented digests can use.
  static constexpr std::size_t kMaxObservations = 1 << 16;

  struct Recorded {
    std::int64_t decisions = 0;       ///< Decisions and certified plans.
    std::set<Digest> observations{};  ///< Their observations digests; the first kMaxObservations.
  };

  std::int64_t events = 0, candidates = 0, decisions = 0;
  std::map<Digest, Recorded>
      configs;                ///< By the config digest of decisions and certified plans; the first kMaxConfigs.
  std::vector<Digest> order;  ///< The keys of `configs` in the order of their first appearance.
};

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

/** Reads a log. Cost: one pass. @throws BadInput if the file is not an event log. */
[[nodiscard]] LogEnds EndsOf(const std::string& log);

/** Whether the heartbeats of certifier or logger go on from one to the other. Nothing if no heartbeats tell. */
[[nodiscard]] std::optional<bool> Continues(const LogEnds& before, const LogEnds& log);

/** kOneRun: the logs must be consecutive files of one run. */
enum class LogOrder { kOneRun, kAny };

/** Reads logs. Cost: one pass over them.
@throws BadInput
- if a file is not an event log; the text says what it is;
- if a file is named twice;
- for kOneRun, if a log belongs to another run than the logs before it. The heartbeats of certifier and logger continue
  from file to file of one run; without heartbeats this is not checked. */
[[nodiscard]] LogSurvey Survey(const std::vector<std::string>& logs, LogOrder order = LogOrder::kOneRun);

/** As Survey. @throws BadInput also if the logs have neither a candidate nor a decision. */
[[nodiscard]] LogSurvey SurveyRun(const std::vector<std::string>& logs);

/** The kind of a file, by its first bytes. */
enum class FileKind { kDirectory, kEmpty, kEventLog, kDatabase, kJson, kOther };

/** @throws LogError if the file cannot be read. */
[[nodiscard]] FileKind KindOf(const std::string& path);

}  // namespace forereach
