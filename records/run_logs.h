/** What a command line names, as runs: which logs belong together, and whose they are. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "records/database.h"

namespace forereach {

/** The files of one run, in their order. */
struct RunLogs {
  /** Tells the logs of several robots apart: the name that the logger wrote into the database, otherwise the directory
  of the logs as it was named. */
  std::string robot;
  std::vector<std::string> logs;  ///< Paths. Only a run of a database may have none.
  std::string database;           ///< The path of the database that lists them; empty if there is none.
  std::vector<RunRow> missing;    ///< Files that the database lists and that are not beside it.
};

struct NamedRuns {
  std::vector<RunLogs> runs;
  std::vector<std::string> missing;  ///< What cannot be read, with the reason.
  /** True for a directory, a database or logs of several runs. Then what one run lacks does not stop the others. */
  bool is_many = false;
};

/** Finds the runs of files and directories, each with its subdirectories.
- A database has its runs in the order in which they began.
- The logs of a directory are its files *.lcmlog and, as lcm-logger names them, lcmlog-*; those that its database lists
are runs of the database. Of the others, in the order of their names, a log continues the one before if its heartbeats
do (LogOrder::kOneRun).
- Logs that are named one by one are one run in the order given, as long as the heartbeats go on.
Links to directories are not followed, and of several names of one file in a directory one is read.
Cost: the ends of logs that no database lists (EndsOf), on `jobs` threads, unless it is a single log.
@throws BadInput if an input is neither, or is named twice, or if there is no run. */
[[nodiscard]] NamedRuns RunsNamedBy(const std::vector<std::string>& inputs, unsigned jobs);

/** Names a run to people: its first log, or its database. */
[[nodiscard]] std::string NameOf(const RunLogs& run);

/** Bytes of its logs, for a progress bar. */
[[nodiscard]] std::int64_t BytesOf(const RunLogs& run);

/** Why a log of a run is missing: a clause that may follow a colon. */
[[nodiscard]] std::string WhyMissing(const RunRow& run);

}  // namespace forereach
