/** The decision database: SQLite, one file for all runs of a directory. Only its source file sees SQL.

Tables: `decisions`, `execution_events`, `gaps` as in rows.h, and `runs`, one row for each log file. The journal is a
write-ahead log: a transaction is there whole or not at all after a kill, and after a power cut too. What `runs` is told
is on the disk when the call returns, with all that was written before. A cut may take the rows written since; the event
log is always written first, so they are made again from it. */
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "lcmtypes/bad_input.h"
#include "records/event_log.h"
#include "records/rows.h"

struct sqlite3;

namespace forereach {

/** The database cannot be opened, or is not ours to write; the text names the file and the reason. */
class DatabaseError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** One log file: a run of the logger, or a part of one. */
struct RunRow {
  std::string log_file;
  std::int64_t start_utime = 0;
  std::optional<std::int64_t> end_utime;  ///< Nothing while it runs, or if it was killed.
  std::int64_t events = 0;                ///< Rows of events with lower numbers than this are all here.
  int schema = 0;                         ///< Of the database when the run began.
  std::string recovered;                  ///< What a later start had to mend, empty after a clean end.
  std::string continues;                  ///< The log file of the same run before this one; empty for the first.
  std::optional<std::int64_t> log_deleted_utime;  ///< When the log was deleted for the quota; its rows stay.
};

class Database final {
 public:
  static constexpr int kSchemaVersion = 2;  ///< PRAGMA user_version

  /** Creates the file, or opens it and brings an older schema up to date.
  @throws DatabaseError if it cannot be opened, belongs to another program or has a newer schema. */
  explicit Database(const std::string& path);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /** Writes all rows in one transaction, or none, and with them that all rows of the first `events` events of the log
  file are here now. A row whose log event has one already is left out.
  @return the number of rows that are new, or nothing on failure; `problem` then says why. */
  [[nodiscard]] std::optional<int> Write(const Rows& rows, const std::string& log_file, std::int64_t events);

  /** Each is a transaction of its own, which the disk has confirmed. @throws DatabaseError. */
  void BeginRun(const std::string& log_file, std::int64_t start_utime, const std::string& continues = "");
  void EndRun(const std::string& log_file, std::int64_t end_utime, const std::string& recovered = "");
  void MarkLogDeleted(const std::string& log_file, std::int64_t utime);
  /** In the order in which they began. @throws DatabaseError, also if one names its log with anything but a file name:
  the database may come from elsewhere, and its logs are looked for beside it. */
  [[nodiscard]] std::vector<RunRow> Runs();

  /** The rows of one log file in the order of its events; of all files for an empty name. @throws DatabaseError. */
  [[nodiscard]] Rows Read(const std::string& log_file = "");

  /** The events that rows of one log file come from, by number; twice if rows differ in the digest. @throws
  DatabaseError. */
  [[nodiscard]] std::vector<LogReference> References(const std::string& log_file);

  /** The config digests of a log file's decisions. @throws DatabaseError. */
  [[nodiscard]] std::set<std::string> ConfigDigests(const std::string& log_file);

  /** The events of a log file that have a gap before them. @throws DatabaseError. */
  [[nodiscard]] std::set<std::int64_t> EventsBehindGaps(const std::string& log_file);

  /** Messages that a log file's gaps without an event count as lost, by channel. @throws DatabaseError. */
  [[nodiscard]] std::map<std::string, std::int64_t> LossesWithoutEvents(const std::string& log_file);

  /** Whether what is written gets to the database's path: nothing, or what is no longer in its place, in words. Cost:
  three looks at the file system. */
  [[nodiscard]] std::optional<std::string> FindDisplaced();
  /** Brings what stands in the write-ahead log into the database file, where that is possible. */
  void Checkpoint();

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  class Statement;

  void Execute(const char* sql);
  template <class... Values>
  void RunDurably(const char* sql, const Values&... values);
  void Migrate();
  int Insert(Statement& insert, const auto& row);
  template <class Row>
  std::vector<Row> Select(const char* sql, const auto&... values);

  std::string path_, problem_;
  std::map<std::string, FileIdentity> files_;  // of the database, by the end of their names; as they were first seen
  std::unique_ptr<sqlite3, int (*)(sqlite3*)> handle_;
  std::unique_ptr<Statement> insert_decision_, insert_event_, insert_gap_, set_events_;
};

}  // namespace forereach
