/** What a file is that somebody names as a log, and whether logs belong together. */
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "lcmtypes/codec.h"
#include "records/event_log.h"

namespace forereach {

/** The content of logs for any names of channels: messages are recognised by their types. */
struct LogSurvey {
  static constexpr std::size_t kMaxConfigs = 256;  ///< Who invents digests must not fill the memory.
  static constexpr std::size_t kMaxObservations = 1 << 16;

  struct Recorded {
    std::int64_t decisions = 0;       ///< And certified plans.
    std::set<Digest> observations{};  ///< The observations digests in them; the first kMaxObservations.
  };

  std::int64_t events = 0, candidates = 0, decisions = 0;
  std::map<Digest, Recorded>
      configs;                ///< By the config digest of decisions and certified plans; the first kMaxConfigs.
  std::vector<Digest> order;  ///< Of these, as they came first.
};

/** Whether logs have to follow one another, as the files of one run do. */
enum class LogOrder { kOneRun, kAny };

/** Reads logs.
@throws BadInput if a file is no event log, and says what it is; if a log has to follow those before it and is of
another run: the heartbeats of the certifier or of the logger go on from file to file of one run, and where there are
none nothing is known; if one is named twice. Cost: one pass over the logs. */
[[nodiscard]] LogSurvey Survey(const std::vector<std::string>& logs, LogOrder order = LogOrder::kOneRun);

/** As Survey, but logs that hold neither a candidate nor a decision are bad input too. */
[[nodiscard]] LogSurvey SurveyRun(const std::vector<std::string>& logs);

/** The first bytes of each, as the first look tells it. */
enum class FileKind { kDirectory, kEmpty, kEventLog, kDatabase, kJson, kOther };

/** @throws LogError if the file cannot be read. */
[[nodiscard]] FileKind KindOf(const std::string& path);

}  // namespace forereach
