/** The runs of a decision database: which logs beside it belong together. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "records/database.h"

namespace forereach {

/** The files of one run, in their order. */
struct RunLogs {
  std::vector<std::string> logs;  ///< Paths of those that are beside the database.
  std::vector<RunRow> missing;    ///< The others: deleted for the quota, or not in the directory.
};

/** The database of a directory, or the file itself if it is a database; nothing for a file of another kind.
@throws ConfigError for a directory without one, LogError if the file cannot be read. */
[[nodiscard]] std::optional<std::string> DatabaseOf(const std::string& path);

/** All runs of a database, in the order in which they began. @throws DatabaseError. */
[[nodiscard]] std::vector<RunLogs> RunsOf(Database& database);

/** Why a log of a run is missing, as a sentence's end. */
[[nodiscard]] std::string WhyMissing(const RunRow& run);

/** What a command line names: event logs of one run; or a database, or the directory of one, with all its runs. */
struct NamedRuns {
  std::vector<std::vector<std::string>> runs;  ///< The logs of each, at least one.
  std::vector<std::string> missing;  ///< Logs that the database names and that are not there, with the reason.
  bool of_database = false;
};

/** @throws BadInput if a database is named beside other inputs, or cannot be read. */
[[nodiscard]] NamedRuns RunsNamedBy(const std::vector<std::string>& inputs);

/** Bytes of all their logs, for a progress bar. */
[[nodiscard]] std::int64_t BytesOf(const NamedRuns& named);

/** The database among the inputs of a command, which then is the only input. @throws BadInput as RunsNamedBy. */
[[nodiscard]] std::optional<std::string> DatabaseAmong(const std::vector<std::string>& inputs);

}  // namespace forereach
