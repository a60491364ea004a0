/** Brings the rows of logs and loggers' databases into the fleet's store.

A logger's directory is the spool: what it writes there while the server is away is sent when the server is back, and a
row that was sent twice is there once. Logs without a database give the rows that a logger would have made of them. */
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fleet/store.h"
#include "records/database.h"
#include "records/log_trust.h"
#include "records/run_logs.h"
#include "records/shard.h"

namespace forereach {

struct IngestOptions {
  std::string robot;   ///< Whose logs they are whose logger had no keys; empty: those are refused.
  std::string config;  ///< The task of logs without a database; empty: the one that is kept beside them.
  LogKey key;
  /** Sends the rows whose event has this number modulo the count. */
  Shard shard;
};

/** What was sent. */
struct Ingested {
  std::int64_t logs = 0, decisions = 0, events = 0, gaps = 0, transitions = 0;
  std::int64_t added = 0;  ///< The rows that were not in the store before.

  Ingested& operator+=(const Ingested& more);
};

/** A logger's database, which may be written meanwhile. */
class DatabaseIngest final {
 public:
  /** @throws DatabaseError. */
  DatabaseIngest(std::string path, Store& store, const IngestOptions& options);

  /** Sends what the database has and this object has not sent. After StoreAway the next call goes on.
  @throws StoreError, DatabaseError; BadInput if a run has no robot's name. */
  Ingested Send();

 private:
  void Open();
  void LearnRuns();
  [[nodiscard]] const std::string& RobotOf(const std::string& log_file);
  [[nodiscard]] bool IsThere(const std::string& robot, const std::string& log_file);
  [[nodiscard]] std::map<std::string, Rows> ToSend(Rows rows);
  void SendStates(const std::vector<RunRow>& runs, Ingested& sum);

  const std::string path_;
  Store& store_;
  const IngestOptions options_;
  std::unique_ptr<Database> database_;
  RowMarks marks_;                         // of the rows that were sent
  std::map<std::string, RunRow> runs_;     // by log, with the robot's name from the options where they have none
  std::map<std::string, bool> was_there_;  // whether the store had all rows of a log before it was read
  std::map<std::string, RunRow> sent_;     // the last state of each log
};

/** Sends the rows of a run's logs, which no database lists. @throws BadInput. */
Ingested IngestLogs(const RunLogs& run, Store& store, const IngestOptions& options);

}  // namespace forereach
