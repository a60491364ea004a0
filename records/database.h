/** The decision database: SQLite, one file for all runs of a directory. Only its source file and schema.h see SQL.

Tables: `decisions`, `execution_events`, `gaps` and `transitions` as in rows.h, and `runs` with one row for each log
file. The journal is a write-ahead log, so after a kill or a power failure each transaction is there either whole or not
at all. When a call that writes to `runs` returns, its row and all earlier rows are on the disk. A power failure may
lose rows written since. The event log is always written first, so those rows can be made again. */
#pragma once

#include <cstdint>
#include <functional>
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

/** The database cannot be opened, or belongs to another program. The text names the file and the reason. */
class DatabaseError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** One log file: a run of the logger, or a part of one. */
struct RunRow {
  std::string log_file;
  std::int64_t start_utime = 0;
  std::optional<std::int64_t> end_utime;  ///< No value while the run lasts, or if its logger was killed.
  std::int64_t events = 0;                ///< The database has all rows of events with lower numbers.
  std::string recovered;                  ///< The repairs by a later start; empty after a clean end.
  std::string continues;                  ///< The log file of the same run before this one; empty for the first.
  std::optional<std::int64_t> log_deleted_utime;  ///< When the log was deleted for the quota; its rows stay.
  std::string robot;                              ///< The name in the logger's keys; empty without keys.
};

/** How far the rows of a database have been read. */
struct RowMarks {
  std::int64_t decisions = 0, events = 0, gaps = 0, transitions = 0;
};

class Database final {
 public:
  static constexpr int kSchemaVersion = 7;  ///< PRAGMA user_version: another one after every change of the tables.

  /** Creates the file, or opens it.
  @throws DatabaseError if it cannot be opened, belongs to another program or has another schema. */
  explicit Database(const std::string& path);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /** Writes all rows in one transaction, and with them that the database now has all rows of the log file's first
  `events` events. Skips a row whose event already has a row.
  @return the number of new rows, or nothing on failure; then nothing was written, and `problem` has the reason. */
  [[nodiscard]] std::optional<int> Write(const Rows& rows, const std::string& log_file, std::int64_t events);

  /** Each of these is a transaction that the disk has confirmed when the call returns. @throws DatabaseError. */
  void BeginRun(const std::string& log_file, std::int64_t start_utime, const std::string& continues = "",
                const std::string& robot = "");
  void EndRun(const std::string& log_file, std::int64_t end_utime, const std::string& recovered = "");
  void MarkLogDeleted(const std::string& log_file, std::int64_t utime);
  /** All runs in the order in which they began. @throws DatabaseError, also if a log's name is not a plain file name:
  the database may come from elsewhere, and its logs are read from its directory. */
  [[nodiscard]] std::vector<RunRow> Runs();

  /** The rows of one log file in the order of its events; of all files for an empty name. @throws DatabaseError. */
  [[nodiscard]] Rows Read(const std::string& log_file = "");

  /** The same of one log file, in blocks: all decisions, then all events, all gaps, all transitions. */
  void ReadInBlocks(const std::string& log_file, const std::function<void(const Rows&)>& take);

  /** How many rows of one log file there are. @throws DatabaseError. */
  [[nodiscard]] RowCounts Count(const std::string& log_file);

  /** The next rows of all runs in the order in which they were written, at most `most` of each table, and moves the
  marks behind them. Another program may be writing. @throws DatabaseError. */
  [[nodiscard]] Rows ReadNext(RowMarks& marks, int most);

  /** The rows of one log file whose events have numbers from `first` to `last`. @throws DatabaseError. */
  [[nodiscard]] Rows ReadRange(const std::string& log_file, std::int64_t first, std::int64_t last);
  /** The numbers of those events, each divided by `size` towards zero; sorted. @throws DatabaseError. */
  [[nodiscard]] std::vector<std::int64_t> EventBlocks(const std::string& log_file, std::int64_t size);

  /** The log files of rows that no run has. @throws DatabaseError. */
  [[nodiscard]] std::vector<std::string> LogsWithoutRun();

  /** The config digests of a log file's decisions. @throws DatabaseError. */
  [[nodiscard]] std::set<std::string> ConfigDigests(const std::string& log_file);

  /** The events of a log file that have a gap before them. @throws DatabaseError. */
  [[nodiscard]] std::set<std::int64_t> EventsBehindGaps(const std::string& log_file);

  /** The losses in those gaps of a log file that have no event, by channel. @throws DatabaseError. */
  [[nodiscard]] std::map<std::string, std::int64_t> LossesWithoutEvents(const std::string& log_file);

  /** Checks that the database's files are still at their paths. @return the name of the displaced file, or nothing.
  Cost: three calls to the file system. */
  [[nodiscard]] std::optional<std::string> FindDisplaced();
  /** Moves the content of the write-ahead log into the database file if possible. */
  void Checkpoint();

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  class Statement;

  void Execute(const char* sql);
  template <class... Values>
  void RunDurably(const char* sql, const Values&... values);
  void MakeOrCheck();
  int Insert(Statement& insert, const auto& row);
  template <class Row>
  std::vector<Row> Select(const char* sql, const auto&... values);

  std::string path_, problem_;
  std::map<std::string, FileIdentity> files_;  // of the database, by the end of their names; as they were first seen
  std::unique_ptr<sqlite3, int (*)(sqlite3*)> handle_;
  std::vector<std::unique_ptr<Statement>> inserts_;  // into each table
  std::unique_ptr<Statement> set_events_;
};

}  // namespace forereach
