#include "records/database.h"

#include <array>
#include <cerrno>
#include <string_view>

#include <sqlite3.h>
#include <nlohmann/json.hpp>

namespace forereach {
namespace {

constexpr int kApplicationId = 0x46524C47;  // "FRLG", so that no other program's file is taken for ours

// With a write-ahead log: the disk need not confirm a transaction before the next begins.
constexpr const char* kLazily = "PRAGMA synchronous = NORMAL";

// Entry k brings schema version k to k + 1. Entries are only ever added.
constexpr std::array<const char*, Database::kSchemaVersion> kMigrations{R"sql(
  CREATE TABLE runs (
    log_file TEXT PRIMARY KEY, start_utime INTEGER NOT NULL, end_utime INTEGER,
    events INTEGER NOT NULL DEFAULT 0, schema INTEGER NOT NULL, recovered TEXT NOT NULL DEFAULT '');
  CREATE TABLE decisions (
    log_file TEXT NOT NULL, event_number INTEGER NOT NULL,
    utime INTEGER NOT NULL, candidate_utime INTEGER NOT NULL, sequence INTEGER NOT NULL,
    source TEXT NOT NULL, plan_id INTEGER NOT NULL, outcome TEXT NOT NULL, cause TEXT NOT NULL,
    step INTEGER, coordinate INTEGER, obstacle INTEGER, first_observation INTEGER, second_observation INTEGER,
    margin REAL, threshold REAL, elapsed_us REAL, latency_us REAL, message TEXT NOT NULL,
    plan_digest TEXT NOT NULL, config_digest TEXT NOT NULL, model_digest TEXT NOT NULL,
    declaration_digest TEXT NOT NULL, observations_digest TEXT NOT NULL, obstacles_digest TEXT NOT NULL,
    UNIQUE (log_file, event_number));
  CREATE TABLE execution_events (
    log_file TEXT NOT NULL, event_number INTEGER NOT NULL,
    utime INTEGER NOT NULL, sequence INTEGER NOT NULL, plan_id INTEGER, kind TEXT NOT NULL,
    step INTEGER, coordinate INTEGER, state TEXT NOT NULL, value REAL, message TEXT NOT NULL,
    UNIQUE (log_file, event_number));
  CREATE TABLE gaps (
    log_file TEXT NOT NULL, event_number INTEGER, channel TEXT NOT NULL, source TEXT NOT NULL,
    expected INTEGER, got INTEGER, lost INTEGER NOT NULL, utime INTEGER NOT NULL, reason TEXT NOT NULL,
    UNIQUE (log_file, event_number, reason));
)sql",
                                                                        R"sql(
  ALTER TABLE runs ADD COLUMN continues TEXT NOT NULL DEFAULT '';
  ALTER TABLE runs ADD COLUMN log_deleted_utime INTEGER;
  ALTER TABLE decisions ADD COLUMN event_digest TEXT NOT NULL DEFAULT '';
  ALTER TABLE execution_events ADD COLUMN event_digest TEXT NOT NULL DEFAULT '';
  ALTER TABLE gaps ADD COLUMN event_digest TEXT NOT NULL DEFAULT '';
)sql"};

}  // namespace

/** A prepared statement. Bind takes values in order, Read gives columns in order. */
class Database::Statement final {
 public:
  Statement(sqlite3* handle, const char* sql) : handle_(handle) {
    if (sqlite3_prepare_v3(handle, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement_, nullptr) != SQLITE_OK)
      throw DatabaseError(sqlite3_errmsg(handle));
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  template <class... Values>
  Statement& Bind(const Values&... values) {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
    column_ = 0;
    (BindNext(values), ...);
    return *this;
  }

  /** True if there is a row. */
  bool Step() {
    column_ = 0;
    const int result = sqlite3_step(statement_);
    if (result != SQLITE_ROW) sqlite3_reset(statement_);
    if (result != SQLITE_ROW && result != SQLITE_DONE) throw DatabaseError(sqlite3_errmsg(handle_));
    return result == SQLITE_ROW;
  }

  /** Runs it to its end and returns how many rows it changed. */
  int Run() {
    while (Step()) {
    }
    return sqlite3_changes(handle_);
  }

  template <class... Values>
  void Read(Values&... values) {
    (ReadNext(values), ...);
  }

 private:
  void BindNext(std::int64_t value) { sqlite3_bind_int64(statement_, ++column_, value); }
  void BindNext(int value) { sqlite3_bind_int64(statement_, ++column_, value); }
  void BindNext(double value) { sqlite3_bind_double(statement_, ++column_, value); }  // NaN becomes NULL
  void BindNext(const std::string& value) {
    sqlite3_bind_text(statement_, ++column_, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT);
  }
  void BindNext(const std::vector<double>& value) { BindNext(nlohmann::json(value).dump()); }
  void BindNext(const std::array<std::string, kGrounds.size()>& values) {
    for (const std::string& value : values) BindNext(value);
  }
  template <class Value>
  void BindNext(const std::optional<Value>& value) {
    if (value) return BindNext(*value);
    sqlite3_bind_null(statement_, ++column_);
  }

  bool IsNull() const { return sqlite3_column_type(statement_, column_) == SQLITE_NULL; }
  void ReadNext(std::int64_t& value) { value = sqlite3_column_int64(statement_, column_++); }
  void ReadNext(int& value) { value = sqlite3_column_int(statement_, column_++); }
  void ReadNext(double& value) {
    value = IsNull() ? kUnknown : sqlite3_column_double(statement_, column_);
    ++column_;
  }
  void ReadNext(std::string& value) {
    const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column_));
    value.assign(text ? text : "", static_cast<std::size_t>(sqlite3_column_bytes(statement_, column_++)));
  }
  void ReadNext(std::array<std::string, kGrounds.size()>& values) {
    for (std::string& value : values) ReadNext(value);
  }
  void ReadNext(std::vector<double>& value) {
    std::string text;
    ReadNext(text);
    value.clear();
    for (const auto& entry : nlohmann::json::parse(text))
      value.push_back(entry.is_null() ? kUnknown : entry.get<double>());
  }
  void ReadNext(std::optional<std::int64_t>& value) {
    value = IsNull() ? std::nullopt : std::optional(sqlite3_column_int64(statement_, column_));
    ++column_;
  }

  sqlite3* handle_;
  sqlite3_stmt* statement_ = nullptr;
  int column_ = 0;
};

Database::Database(const std::string& path) : path_(path), handle_(nullptr, &sqlite3_close) {
  sqlite3* handle = nullptr;
  const int result = sqlite3_open_v2(path.c_str(), &handle, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  handle_.reset(handle);
  try {
    if (result != SQLITE_OK) throw DatabaseError(handle ? sqlite3_errmsg(handle) : "out of memory");
    sqlite3_busy_timeout(handle, 2000);
    Migrate();
    // Where the file system allows no write-ahead log SQLite keeps its rollback journal, which is as safe and slower.
    Execute("PRAGMA journal_mode = WAL");
    Execute(kLazily);
    insert_decision_ = std::make_unique<Statement>(handle, R"sql(INSERT INTO decisions VALUES
      (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)
      ON CONFLICT (log_file, event_number) DO NOTHING)sql");
    insert_event_ = std::make_unique<Statement>(handle, R"sql(INSERT INTO execution_events VALUES
      (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (log_file, event_number) DO NOTHING)sql");
    insert_gap_ = std::make_unique<Statement>(handle, R"sql(INSERT INTO gaps VALUES
      (?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (log_file, event_number, reason) DO NOTHING)sql");
    set_events_ = std::make_unique<Statement>(handle, "UPDATE runs SET events = ? WHERE log_file = ?");
    static_cast<void>(FindDisplaced());
  } catch (const DatabaseError& error) {
    throw DatabaseError("database: " + path + ": " + error.what());
  }
}

Database::~Database() = default;

void Database::Execute(const char* sql) {
  if (sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK)
    throw DatabaseError(sqlite3_errmsg(handle_.get()));
}

void Database::Migrate() {
  Execute("BEGIN IMMEDIATE");
  const auto number = [this](const char* sql) {
    Statement statement(handle_.get(), sql);
    std::int64_t value = 0;
    if (statement.Bind().Step()) statement.Read(value);
    return value;
  };
  const std::int64_t version = number("PRAGMA user_version");
  if (version > kSchemaVersion)
    throw DatabaseError("schema version " + std::to_string(version) + ", this program knows versions up to " +
                        std::to_string(kSchemaVersion) + ": use a newer program or another directory");
  const bool fresh = number("SELECT count(*) FROM sqlite_master") == 0;
  if (version < 0 || (!fresh && number("PRAGMA application_id") != kApplicationId))
    throw DatabaseError("not a decision database: move it away or use another directory");
  for (std::size_t next = static_cast<std::size_t>(version); next < kMigrations.size(); ++next)
    Execute(kMigrations[next]);
  Execute(("PRAGMA application_id = " + std::to_string(kApplicationId)).c_str());
  Execute(("PRAGMA user_version = " + std::to_string(kSchemaVersion)).c_str());
  Execute("COMMIT");
}

std::optional<std::string> Database::FindDisplaced() {
  for (const char* ending : {"", "-wal", "-shm"}) {
    errno = 0;
    const std::optional<FileIdentity> found = IdentityOf(path_ + ending);
    if (!found && errno != ENOENT && errno != ENOTDIR) continue;  // it cannot be looked at
    const auto known = files_.find(ending);
    if (known == files_.end()) {
      if (found) files_.emplace(ending, *found);  // those of the write-ahead log come with the first transaction
    } else if (found != known->second) {
      return path_ + ending + (found ? " was replaced" : " was deleted or moved");
    }
  }
  return std::nullopt;
}

void Database::Checkpoint() {
  sqlite3_wal_checkpoint_v2(handle_.get(), nullptr, SQLITE_CHECKPOINT_FULL, nullptr, nullptr);
}

std::optional<int> Database::Write(const Rows& rows, const std::string& log_file, std::int64_t events) {
  int written = 0;
  try {
    Execute("BEGIN IMMEDIATE");
    for (const DecisionRow& row : rows.decisions) written += Insert(row);
    for (const EventRow& row : rows.events) written += Insert(row);
    for (const GapRow& row : rows.gaps) written += Insert(row);
    set_events_->Bind(events, log_file).Run();
    Execute("COMMIT");
    return written;
  } catch (const DatabaseError& error) {
    problem_ = "database: " + path_ + ": " + error.what();
    if (sqlite3_get_autocommit(handle_.get()) == 0) sqlite3_exec(handle_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
    return std::nullopt;
  }
}

int Database::Insert(const DecisionRow& row) {
  return insert_decision_
      ->Bind(row.event.log_file, row.event.event_number, row.utime, row.candidate_utime, row.sequence, row.source,
             row.plan_id, row.outcome, row.cause, row.step, row.coordinate, row.obstacle, row.first_observation,
             row.second_observation, row.margin, row.threshold, row.elapsed_us, row.latency_us, row.message,
             row.plan_digest, row.grounds, row.event.digest)
      .Run();
}

int Database::Insert(const EventRow& row) {
  return insert_event_
      ->Bind(row.event.log_file, row.event.event_number, row.utime, row.sequence, row.plan_id, row.kind, row.step,
             row.coordinate, row.state, row.value, row.message, row.event.digest)
      .Run();
}

int Database::Insert(const GapRow& row) {
  const auto or_null = [](std::int64_t value) { return value < 0 ? std::nullopt : std::optional(value); };
  return insert_gap_
      ->Bind(row.event.log_file, or_null(row.event.event_number), row.channel, row.source, or_null(row.expected),
             or_null(row.got), row.lost, row.utime, row.reason, row.event.digest)
      .Run();
}

template <class... Values>
void Database::RunDurably(const char* sql, const Values&... values) {
  Execute("PRAGMA synchronous = FULL");
  try {
    Statement(handle_.get(), sql).Bind(values...).Run();
  } catch (const DatabaseError&) {
    Execute(kLazily);
    throw;
  }
  Execute(kLazily);
}

void Database::BeginRun(const std::string& log_file, std::int64_t start_utime, const std::string& continues) {
  RunDurably("INSERT INTO runs (log_file, start_utime, schema, continues) VALUES (?, ?, ?, ?)", log_file, start_utime,
             kSchemaVersion, continues);
}

void Database::EndRun(const std::string& log_file, std::int64_t end_utime, const std::string& recovered) {
  RunDurably("UPDATE runs SET end_utime = ?, recovered = ? WHERE log_file = ?", end_utime, recovered, log_file);
}

void Database::MarkLogDeleted(const std::string& log_file, std::int64_t utime) {
  RunDurably("UPDATE runs SET log_deleted_utime = ? WHERE log_file = ?", utime, log_file);
}

std::vector<RunRow> Database::Runs() {
  std::vector<RunRow> runs;
  Statement select(handle_.get(), R"sql(SELECT log_file, start_utime, end_utime, events, schema, recovered, continues,
      log_deleted_utime FROM runs ORDER BY rowid)sql");
  for (select.Bind(); select.Step();) {
    RunRow& run = runs.emplace_back();
    select.Read(run.log_file, run.start_utime, run.end_utime, run.events, run.schema, run.recovered, run.continues,
                run.log_deleted_utime);
    for (const std::string& file : {run.log_file, run.continues})
      if (file.find_first_of(std::string_view("/\0", 2)) != std::string::npos || file == "." || file == "..")
        throw DatabaseError("database: " + path_ + ": a run names a log that is not in its directory: " + file);
  }
  return runs;
}

std::vector<LogReference> Database::References(const std::string& log_file) {
  std::vector<LogReference> references;
  Statement select(handle_.get(), R"sql(
      SELECT event_number, event_digest FROM decisions WHERE log_file = ?1
      UNION SELECT event_number, event_digest FROM execution_events WHERE log_file = ?1
      UNION SELECT event_number, event_digest FROM gaps WHERE log_file = ?1 AND event_number IS NOT NULL
      ORDER BY event_number)sql");
  for (select.Bind(log_file); select.Step();) {
    LogReference& reference = references.emplace_back(LogReference{log_file, -1, {}});
    select.Read(reference.event_number, reference.digest);
  }
  return references;
}

std::set<std::string> Database::ConfigDigests(const std::string& log_file) {
  std::set<std::string> digests;
  Statement select(handle_.get(), "SELECT DISTINCT config_digest FROM decisions WHERE log_file = ?");
  for (select.Bind(log_file); select.Step();) {
    std::string digest;
    select.Read(digest);
    digests.insert(digest);
  }
  return digests;
}

std::set<std::int64_t> Database::EventsBehindGaps(const std::string& log_file) {
  std::set<std::int64_t> events;
  Statement select(handle_.get(), "SELECT event_number FROM gaps WHERE log_file = ? AND event_number IS NOT NULL");
  for (select.Bind(log_file); select.Step();) {
    std::int64_t number = 0;
    select.Read(number);
    events.insert(number);
  }
  return events;
}

std::map<std::string, std::int64_t> Database::LossesWithoutEvents(const std::string& log_file) {
  std::map<std::string, std::int64_t> losses;
  Statement select(handle_.get(),
                   "SELECT channel, lost FROM gaps WHERE log_file = ? AND event_number IS NULL AND lost > 0");
  for (select.Bind(log_file); select.Step();) {
    std::string channel;
    std::int64_t lost = 0;
    select.Read(channel, lost);
    std::int64_t& sum = losses[channel];
    sum = SumOfLost(sum, lost);
  }
  return losses;
}

Rows Database::Read(const std::string& log_file) {
  Rows rows;
  Statement decisions(handle_.get(),
                      "SELECT * FROM decisions WHERE ?1 IN ('', log_file) ORDER BY log_file, event_number");
  for (decisions.Bind(log_file); decisions.Step();) {
    DecisionRow& row = rows.decisions.emplace_back();
    decisions.Read(row.event.log_file, row.event.event_number, row.utime, row.candidate_utime, row.sequence, row.source,
                   row.plan_id, row.outcome, row.cause, row.step, row.coordinate, row.obstacle, row.first_observation,
                   row.second_observation, row.margin, row.threshold, row.elapsed_us, row.latency_us, row.message,
                   row.plan_digest, row.grounds, row.event.digest);
  }
  Statement events(handle_.get(),
                   "SELECT * FROM execution_events WHERE ?1 IN ('', log_file) ORDER BY log_file, event_number");
  for (events.Bind(log_file); events.Step();) {
    EventRow& row = rows.events.emplace_back();
    events.Read(row.event.log_file, row.event.event_number, row.utime, row.sequence, row.plan_id, row.kind, row.step,
                row.coordinate, row.state, row.value, row.message, row.event.digest);
  }
  Statement gaps(handle_.get(), R"sql(SELECT log_file, ifnull(event_number, -1), channel, source, ifnull(expected, -1),
      ifnull(got, -1), lost, utime, reason, event_digest FROM gaps WHERE ?1 IN ('', log_file) ORDER BY rowid)sql");
  for (gaps.Bind(log_file); gaps.Step();) {
    GapRow& row = rows.gaps.emplace_back();
    gaps.Read(row.event.log_file, row.event.event_number, row.channel, row.source, row.expected, row.got, row.lost,
              row.utime, row.reason, row.event.digest);
  }
  return rows;
}

}  // namespace forereach
