#include "records/database.h"

#include <array>
#include <cerrno>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <sqlite3.h>
#include <nlohmann/json.hpp>

#include "records/schema.h"
#include "task/json_text.h"

namespace forereach {
namespace {

constexpr int kApplicationId = 0x46524C47;  // "FRLG", so that no other program's file is taken for ours

// With a write-ahead log: the disk need not confirm a transaction before the next begins.
constexpr const char* kLazily = "PRAGMA synchronous = NORMAL";

constexpr std::size_t kRowsInBlock = 1024;

constexpr Dialect kDialect{.runs = "runs",
                           .run_key = "log_file",
                           .robot = "",
                           .key = "log_file, event_number",
                           .gap_key = "log_file, event_number, reason",
                           .unique = "UNIQUE",
                           .partitioned = ""};

// SELECT what FROM every table WHERE where; UNION, so each once.
std::string OfAllTables(const char* what, const char* where) {
  std::string sql;
  Rows::ForEachTable([&](const char* table, auto) {
    sql += fmt::format("{}SELECT {} FROM {} WHERE {}", sql.empty() ? "" : " UNION ", what, table, where);
  });
  return sql;
}

// A gap need not have an event.
template <class Row>
constexpr const char* OrderOf() {
  return std::is_same_v<Row, GapRow> ? "rowid" : "log_file, event_number";
}

// Why the last call failed.
std::string WhySqlRefuses(sqlite3* handle) {
  const int code = handle ? sqlite3_errcode(handle) : SQLITE_NOMEM;
  switch (code) {
    case SQLITE_NOMEM: return "there is not enough memory";
    case SQLITE_FULL: return "the disk is full";
    case SQLITE_BUSY:
    case SQLITE_LOCKED: return "another program has locked it";
    case SQLITE_READONLY:
    case SQLITE_PERM: return "it may not be written: its owner and the directory's have to allow it";
    case SQLITE_CANTOPEN: return "it cannot be opened, or not made: look at its path and the directory's owner";
    case SQLITE_IOERR: return "the disk fails to read or write it";
    case SQLITE_CORRUPT:
      return "it is damaged; the next start of the logger makes a new one of the logs, if it is moved away";
    case SQLITE_NOTADB: return "it is no database";
    case SQLITE_CONSTRAINT: return "it refuses a row";
    default: return fmt::format("its tables are not those of a decision database (SQLite's error {})", code);
  }
}

}  // namespace

/** A prepared statement. Bind takes values in order, Read gives columns in order. */
class Database::Statement final {
 public:
  Statement(sqlite3* handle, const char* sql) : handle_(handle) {
    if (sqlite3_prepare_v3(handle, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement_, nullptr) != SQLITE_OK)
      throw DatabaseError(WhySqlRefuses(handle));
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
    if (result != SQLITE_ROW && result != SQLITE_DONE) throw DatabaseError(WhySqlRefuses(handle_));
    return result == SQLITE_ROW;
  }

  /** Runs it to its end and returns how many rows it changed. */
  int Run() {
    while (Step()) {
    }
    return sqlite3_changes(handle_);
  }

  void Read(auto& row) {
    auto columns = ColumnsOf(row);
    std::apply([this](auto&... column) { (this->ReadNext(column.value), ...); }, columns);
  }

 private:
  void BindNext(std::int64_t value) { sqlite3_bind_int64(statement_, ++column_, value); }
  void BindNext(int value) { sqlite3_bind_int64(statement_, ++column_, value); }
  void BindNext(double value) { sqlite3_bind_double(statement_, ++column_, value); }  // NaN becomes NULL
  void BindNext(const std::string& value) {
    sqlite3_bind_text(statement_, ++column_, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT);
  }
  void BindNext(const std::vector<double>& value) { BindNext(JsonText(nlohmann::json(value))); }
  template <class Value>
  void BindNext(const std::optional<Value>& value) {
    if (value) return BindNext(*value);
    sqlite3_bind_null(statement_, ++column_);
  }

  template <class Number>
  void BindNext(OrNull<Number> value) {
    BindNext(value.number == -1 ? std::nullopt : std::optional<std::int64_t>(value.number));
  }

  bool IsNull() const { return sqlite3_column_type(statement_, column_) == SQLITE_NULL; }
  void ReadNext(std::int64_t& value) { value = sqlite3_column_int64(statement_, column_++); }
  void ReadNext(int& value) { value = sqlite3_column_int(statement_, column_++); }
  void ReadNext(double& value) {
    value = IsNull() ? kNoNumber : sqlite3_column_double(statement_, column_);
    ++column_;
  }
  void ReadNext(std::string& value) {
    const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column_));
    value.assign(text ? text : "", static_cast<std::size_t>(sqlite3_column_bytes(statement_, column_++)));
  }
  void ReadNext(std::vector<double>& value) {
    std::string text;
    ReadNext(text);
    value.clear();
    try {
      for (const auto& entry : ParseJson(text)) value.push_back(entry.is_null() ? kNoNumber : entry.get<double>());
    } catch (const nlohmann::json::exception&) {
      throw DatabaseError(fmt::format("a state in it is no list of numbers: {}", text));
    }
  }
  void ReadNext(std::optional<std::int64_t>& value) {
    value = IsNull() ? std::nullopt : std::optional(sqlite3_column_int64(statement_, column_));
    ++column_;
  }
  template <class Number>
  void ReadNext(OrNull<Number>& value) {
    std::optional<std::int64_t> number;
    ReadNext(number);
    value.number = static_cast<Number>(number.value_or(-1));
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
    if (result != SQLITE_OK) throw DatabaseError(WhySqlRefuses(handle));
    sqlite3_busy_timeout(handle, 2000);
    MakeOrCheck();
    // Where the file system allows no write-ahead log SQLite keeps its rollback journal, which is as safe and slower.
    Execute("PRAGMA journal_mode = WAL");
    Execute(kLazily);
    Rows::ForEachTable([&]<class Row>(const char* table, std::vector<Row> Rows::*) {
      std::string places = "?";
      for (auto more = std::tuple_size_v<decltype(ColumnsOf(std::declval<Row&>()))>; more > 1; --more) places += ", ?";
      inserts_.push_back(std::make_unique<Statement>(
          handle,
          fmt::format("INSERT INTO {} VALUES ({}) ON CONFLICT ({}) DO NOTHING", table, places, kDialect.KeyOf<Row>())
              .c_str()));
    });
    set_events_ = std::make_unique<Statement>(handle, "UPDATE runs SET events = ? WHERE log_file = ?");
    static_cast<void>(FindDisplaced());
  } catch (const DatabaseError& error) {
    throw DatabaseError(fmt::format("database: {}: {}", path, error.what()));
  }
}

Database::~Database() = default;

void Database::Execute(const char* sql) {
  if (sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK)
    throw DatabaseError(WhySqlRefuses(handle_.get()));
}

void Database::MakeOrCheck() {
  Execute("BEGIN IMMEDIATE");
  const auto number = [this](const char* sql) { return Select<std::int64_t>(sql).at(0); };
  const bool is_new = number("SELECT count(*) FROM sqlite_master") == 0;
  if (is_new)
    Execute(fmt::format("PRAGMA application_id = {}", kApplicationId).c_str());
  else if (number("PRAGMA application_id") != kApplicationId)
    throw DatabaseError("not a decision database: move it away or use another directory");
  if (const std::int64_t version = number("PRAGMA user_version"); !is_new && version != kSchemaVersion)
    throw DatabaseError(
        fmt::format("schema version {}, this program knows version {}: use the program that made it, or "
                    "another directory",
                    version, kSchemaVersion));
  if (is_new) {
    Execute(TablesSql(kDialect).c_str());
    Execute(fmt::format("PRAGMA user_version = {}", kSchemaVersion).c_str());
  }
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
      return fmt::format("{}{}{}", path_, ending, found ? " was replaced" : " was deleted or moved");
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
    auto insert = inserts_.begin();
    Rows::ForEachTable([&](const char*, auto of_table) {
      for (const auto& row : rows.*of_table) written += Insert(**insert, row);
      ++insert;
    });
    set_events_->Bind(events, log_file).Run();
    Execute("COMMIT");
    return written;
  } catch (const DatabaseError& error) {
    problem_ = fmt::format("database: {}: {}", path_, error.what());
    if (sqlite3_get_autocommit(handle_.get()) == 0) sqlite3_exec(handle_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
    return std::nullopt;
  }
}

int Database::Insert(Statement& insert, const auto& row) {
  return std::apply([&](const auto&... column) { return insert.Bind(column.value...).Run(); }, ColumnsOf(row));
}

template <class Row>
std::vector<Row> Database::Select(const char* sql, const auto&... values) {
  std::vector<Row> rows;
  Statement select(handle_.get(), sql);
  for (select.Bind(values...); select.Step();) select.Read(rows.emplace_back());
  return rows;
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

void Database::BeginRun(const std::string& log_file, std::int64_t start_utime, const std::string& continues,
                        const std::string& robot) {
  RunDurably("INSERT INTO runs (log_file, start_utime, continues, robot) VALUES (?, ?, ?, ?)", log_file, start_utime,
             continues, robot);
}

void Database::EndRun(const std::string& log_file, std::int64_t end_utime, const std::string& recovered) {
  RunDurably("UPDATE runs SET end_utime = ?, recovered = ? WHERE log_file = ?", end_utime, recovered, log_file);
}

void Database::MarkLogDeleted(const std::string& log_file, std::int64_t utime) {
  RunDurably("UPDATE runs SET log_deleted_utime = ? WHERE log_file = ?", utime, log_file);
}

std::vector<RunRow> Database::Runs() {
  const std::vector<RunRow> runs = Select<RunRow>(R"sql(SELECT log_file, start_utime, end_utime, events,
      recovered, continues, log_deleted_utime, robot FROM runs ORDER BY rowid)sql");
  for (const RunRow& run : runs)
    for (const std::string& file : {run.log_file, run.continues})
      if (file.find_first_of(std::string_view("/\0", 2)) != std::string::npos || file == "." || file == "..")
        throw DatabaseError(
            fmt::format("database: {}: a run names a log that is not in its directory: {}", path_, file));
  return runs;
}

Rows Database::ReadRange(const std::string& log_file, std::int64_t first, std::int64_t last) {
  Rows rows;
  Rows::ForEachTable([&]<class Row>(const char* table, std::vector<Row> Rows::*of_table) {
    const std::string sql = fmt::format(
        "SELECT * FROM {} WHERE log_file = ? AND event_number BETWEEN ? AND ? ORDER BY event_number", table);
    rows.*of_table = Select<Row>(sql.c_str(), log_file, first, last);
  });
  return rows;
}

std::vector<std::int64_t> Database::EventBlocks(const std::string& log_file, std::int64_t size) {
  const std::string blocks = OfAllTables("event_number / ?2 AS block", "log_file = ?1 AND event_number IS NOT NULL");
  return Select<std::int64_t>((blocks + " ORDER BY block").c_str(), log_file, size);
}

std::vector<std::string> Database::LogsWithoutRun() {
  return Select<std::string>(OfAllTables("log_file", "log_file NOT IN (SELECT log_file FROM runs)").c_str());
}

std::set<std::string> Database::ConfigDigests(const std::string& log_file) {
  const auto digests = Select<std::string>("SELECT DISTINCT config_digest FROM decisions WHERE log_file = ?", log_file);
  return {digests.begin(), digests.end()};
}

std::set<std::int64_t> Database::EventsBehindGaps(const std::string& log_file) {
  const auto events =
      Select<std::int64_t>("SELECT event_number FROM gaps WHERE log_file = ? AND event_number IS NOT NULL", log_file);
  return {events.begin(), events.end()};
}

std::map<std::string, std::int64_t> Database::LossesWithoutEvents(const std::string& log_file) {
  std::map<std::string, std::int64_t> losses;
  for (const auto& [channel, lost] : Select<std::pair<std::string, std::int64_t>>(
           "SELECT channel, lost FROM gaps WHERE log_file = ? AND event_number IS NULL AND lost > 0", log_file)) {
    std::int64_t& sum = losses[channel];
    sum = SumOfLost(sum, lost);
  }
  return losses;
}

Rows Database::Read(const std::string& log_file) {
  Rows rows;
  Rows::ForEachTable([&]<class Row>(const char* table, std::vector<Row> Rows::*of_table) {
    rows.*of_table = Select<Row>(
        fmt::format("SELECT * FROM {} WHERE ?1 IN ('', log_file) ORDER BY {}", table, OrderOf<Row>()).c_str(),
        log_file);
  });
  return rows;
}

void Database::ReadInBlocks(const std::string& log_file, const std::function<void(const Rows&)>& take) {
  Rows::ForEachTable([&]<class Row>(const char* table, std::vector<Row> Rows::*of_table) {
    Statement select(handle_.get(),
                     fmt::format("SELECT * FROM {} WHERE log_file = ? ORDER BY {}", table, OrderOf<Row>()).c_str());
    Rows block;
    std::vector<Row>& rows = block.*of_table;
    for (select.Bind(log_file); select.Step();) {
      select.Read(rows.emplace_back());
      if (rows.size() < kRowsInBlock) continue;
      take(block);
      rows.clear();
    }
    take(block);
  });
}

RowCounts Database::Count(const std::string& log_file) {
  const auto count = [&](const char* table) {
    return Select<std::int64_t>(fmt::format("SELECT count(*) FROM {} WHERE log_file = ?", table).c_str(), log_file)
        .at(0);
  };
  return {count("decisions"), count("execution_events"), count("gaps"), count("transitions")};
}

Rows Database::ReadNext(RowMarks& marks, int most) {
  Rows rows;
  const auto read = [&]<class Row>(const char* table, std::vector<Row>& to, std::int64_t& mark) {
    const std::string where = fmt::format("FROM {} WHERE rowid > ?1 ORDER BY rowid LIMIT ?2", table);
    const auto last = Select<std::optional<std::int64_t>>(
        fmt::format("SELECT max(rowid) FROM (SELECT rowid {})", where).c_str(), mark, most);
    if (!last.at(0)) return;
    to = Select<Row>(fmt::format("SELECT * FROM {} WHERE rowid > ? AND rowid <= ? ORDER BY rowid", table).c_str(), mark,
                     *last[0]);
    mark = *last[0];
  };
  read("decisions", rows.decisions, marks.decisions);
  read("execution_events", rows.events, marks.events);
  read("gaps", rows.gaps, marks.gaps);
  read("transitions", rows.transitions, marks.transitions);
  return rows;
}

}  // namespace forereach
