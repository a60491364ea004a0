#include "fleet/store.h"

#include <charconv>
#include <chrono>
#include <cmath>
#include <string_view>
#include <tuple>
#include <type_traits>

#include <fmt/format.h>

#include <libpq-fe.h>
#include <nlohmann/json.hpp>
#include <pqxx/connection>
#include <pqxx/except>
#include <pqxx/result>
#include <pqxx/stream_to>
#include <pqxx/transaction>

#include "records/schema.h"
#include "task/json_text.h"

namespace forereach {
namespace {

constexpr Dialect kDialect{
    .runs = "run_states",
    .run_key = "robot, log_file, start_utime, end_utime, events, log_deleted_utime",
    .robot = "robot TEXT NOT NULL,",
    .key = "robot, log_file, event_number, event_utime",
    .gap_key = "robot, log_file, event_number, event_utime, reason, channel, source, expected, got, lost",
    .unique = "UNIQUE NULLS NOT DISTINCT",
    .partitioned = " PARTITION BY RANGE (event_utime)"};

// Two programs that find no tables make them one after the other.
constexpr const char* kLock = "SELECT pg_advisory_xact_lock(1179798599)";  // "FRLG"

// A part of the month that another's rows already keep from being made is left out: they are in the part of all others.
constexpr const char* kAroundTables = R"sql(
  CREATE TABLE forereach_schema (version INTEGER PRIMARY KEY);
  CREATE TABLE decisions_other PARTITION OF decisions DEFAULT;
  CREATE TABLE execution_events_other PARTITION OF execution_events DEFAULT;
  CREATE TABLE gaps_other PARTITION OF gaps DEFAULT;
  CREATE TABLE transitions_other PARTITION OF transitions DEFAULT;
  CREATE VIEW runs WITH (security_invoker = true) AS
    SELECT DISTINCT ON (robot, log_file) * FROM run_states
    ORDER BY robot, log_file, end_utime IS NULL, events DESC, log_deleted_utime NULLS LAST;

  CREATE FUNCTION forereach_month(month INTEGER) RETURNS VOID LANGUAGE plpgsql SECURITY DEFINER
      SET search_path = public, pg_temp AS $$
    DECLARE
      base TEXT;
      part TEXT;
      bounds BIGINT[];
    BEGIN
      IF month < 2020 * 12 OR month >= 2100 * 12 THEN RETURN; END IF;
      PERFORM pg_advisory_xact_lock(1179798599);
      FOR i IN 0..1 LOOP
        bounds[i] := extract(epoch FROM make_timestamptz((month + i) / 12, (month + i) % 12 + 1, 1, 0, 0, 0, 'UTC'))
                     * 1000000;
      END LOOP;
      FOREACH base IN ARRAY ARRAY['decisions', 'execution_events', 'gaps', 'transitions'] LOOP
        part := format('%s_%s_%s', base, month / 12, lpad((month % 12 + 1)::TEXT, 2, '0'));
        IF NOT EXISTS (SELECT FROM pg_tables WHERE schemaname = 'public' AND tablename = part) THEN
          BEGIN
            EXECUTE format('CREATE TABLE %I PARTITION OF %I FOR VALUES FROM (%s) TO (%s)', part, base, bounds[0],
                           bounds[1]);
          EXCEPTION WHEN check_violation THEN NULL;
          END;
        END IF;
      END LOOP;
    END $$;

  DO $$
    DECLARE
      name TEXT;
    BEGIN
      FOREACH name IN ARRAY ARRAY['forereach_robot', 'forereach_reader'] LOOP
        BEGIN
          EXECUTE format('CREATE ROLE %I NOLOGIN', name);
        EXCEPTION WHEN duplicate_object THEN NULL;
        END;
      END LOOP;
      FOREACH name IN ARRAY ARRAY['run_states', 'decisions', 'execution_events', 'gaps', 'transitions'] LOOP
        EXECUTE format('ALTER TABLE %I ENABLE ROW LEVEL SECURITY', name);
        EXECUTE format('CREATE POLICY own ON %I TO forereach_robot USING (robot = current_user) '
                       'WITH CHECK (robot = current_user)', name);
        EXECUTE format('CREATE POLICY every ON %I FOR SELECT TO forereach_reader USING (true)', name);
        EXECUTE format('GRANT SELECT ON %I TO forereach_robot, forereach_reader', name);
        EXECUTE format('GRANT INSERT ON %I TO forereach_robot', name);
      END LOOP;
    END $$;
  GRANT SELECT ON runs, forereach_schema TO forereach_robot, forereach_reader;
  REVOKE ALL ON FUNCTION forereach_month FROM PUBLIC;
  GRANT EXECUTE ON FUNCTION forereach_month TO forereach_robot;
)sql";

// What a session needs, whatever the server's settings are: a transaction is on the disk when it is told to be.
constexpr const char* kSession =
    "SET client_encoding = 'UTF8'; SET search_path = public, pg_temp; SET synchronous_commit = on; SET "
    "extra_float_digits = 1; SET client_min_messages = error";

// Whose rows are copied before they are added.
constexpr const char* kCopies = R"sql(
  CREATE TEMP TABLE new_decisions (LIKE decisions) ON COMMIT DELETE ROWS;
  CREATE TEMP TABLE new_execution_events (LIKE execution_events) ON COMMIT DELETE ROWS;
  CREATE TEMP TABLE new_gaps (LIKE gaps) ON COMMIT DELETE ROWS;
  CREATE TEMP TABLE new_transitions (LIKE transitions) ON COMMIT DELETE ROWS;
  CREATE TEMP TABLE new_run_states (LIKE run_states) ON COMMIT DELETE ROWS;
)sql";

// libpq's parameters, with an end to waiting for a server that does not answer.
std::string ParametersOf(const std::string& address) {
  struct Free {
    void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
  };
  const std::unique_ptr<PQconninfoOption, Free> options(
      Store::IsAddress(address) ? PQconninfoParse(address.c_str(), nullptr) : nullptr);
  if (!options)
    throw StoreError("--database: no address of a PostgreSQL server: postgresql://[USER@]HOST[:PORT]/DATABASE");
  std::string parameters = "connect_timeout='10' tcp_user_timeout='30000' application_name='forereach'";
  for (const PQconninfoOption* option = options.get(); option->keyword; ++option) {
    if (!option->val) continue;
    if (std::string_view(option->keyword).ends_with("password"))
      throw StoreError("--database: everyone on this machine can read a password there: write it into ~/.pgpass");
    parameters += fmt::format(" {}='", option->keyword);
    for (const char c : std::string_view(option->val)) {
      if (c == '\'' || c == '\\') parameters += '\\';
      parameters += c;
    }
    parameters += '\'';
  }
  return parameters;
}

// Why no connection comes about. The server's own sentence could be any text.
std::string WhyNotConnected(const std::string& parameters) {
  switch (PQping(parameters.c_str())) {
    case PQPING_OK: return "the server refuses this user, password or database, or has too many connections";
    case PQPING_REJECT: return "the server is starting or stopping";
    case PQPING_NO_RESPONSE: return "no server answers there";
    default: return "no connection can be tried with these parameters";
  }
}

// libpqxx gives some of its exceptions no number.
std::string StateOf(const pqxx::sql_error& error) {
  if (!error.sqlstate().empty()) return error.sqlstate();
  if (dynamic_cast<const pqxx::insufficient_privilege*>(&error)) return "42501";
  if (dynamic_cast<const pqxx::insufficient_resources*>(&error)) return "53000";
  return {};
}

// Whether the same can succeed later, without anybody's doing here.
bool IsAway(std::string_view state) {
  for (const std::string_view of : {"08", "40", "53", "57P", "58"})
    if (state.starts_with(of)) return true;
  return false;
}

std::string WhyServerRefuses(const std::string& state) {
  const std::string_view of = std::string_view(state).substr(0, 2);
  if (state == "42501")
    return "this user may not do that; the owner of the database makes the tables, see docs/fleet.md";
  if (state == "42P01" || state == "42703") return "its tables are not those of this program";
  if (of == "53") return "the server lacks disk, memory or connections";
  if (of == "57" || of == "08") return "the server ends or restarts";
  if (of == "40") return "the server broke the transaction off for another one's sake";
  if (of == "22" || of == "23" || of == "54") return "the server refuses a value";
  if (of == "25") return "the server is read-only";
  const bool is_plain =
      state.size() == 5 && state.find_first_not_of("0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ") == std::string::npos;
  return fmt::format("the server refuses, with its error {}", is_plain ? state : std::string("of no number"));
}

// A column's value as COPY takes it.
using Field = std::optional<std::string>;
Field FieldOf(std::int64_t value) { return std::to_string(value); }
Field FieldOf(int value) { return std::to_string(value); }
Field FieldOf(double value) {
  if (std::isnan(value)) return std::nullopt;
  if (value == 0) return "0";  // SQLite has no negative zero either
  return std::isinf(value) ? (value > 0 ? "Infinity" : "-Infinity") : fmt::format("{}", value);
}
Field FieldOf(const std::string& value) { return ToStoredText(value); }
Field FieldOf(const std::vector<double>& value) { return JsonText(nlohmann::json(value)); }
Field FieldOf(const std::optional<std::int64_t>& value) { return value ? FieldOf(*value) : std::nullopt; }
template <class Number>
Field FieldOf(OrNull<Number> value) {
  return value.number == -1 ? std::nullopt : FieldOf(value.number);
}

// A run has the robot among its columns.
template <class Row>
auto RowFields(const std::string& robot, const Row& row) {
  const auto columns =
      std::apply([](const auto&... column) { return std::tuple(FieldOf(column.value)...); }, ColumnsOf(row));
  if constexpr (std::is_same_v<Row, RunRow>)
    return columns;
  else
    return std::tuple_cat(std::tuple(FieldOf(robot)), columns);
}

// Reads a row of a table's columns.
class RowReader final {
 public:
  explicit RowReader(const Store::Values& values) : values_(values) {}

  void Read(auto& row) {
    auto columns = ColumnsOf(row);
    std::apply([this](auto&... column) { (this->Next(column.value), ...); }, columns);
  }

 private:
  const std::optional<std::string>& Take() {
    if (at_ == values_.size()) throw StoreError("the store: its tables are not those of this program");
    return values_[at_++];
  }
  template <class Number>
  static Number NumberOf(const std::string& text) {
    Number number{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size())
      throw StoreError("the store: a number in it is none of this program's");
    return number;
  }
  void Next(std::int64_t& value) { value = NumberOf<std::int64_t>(Take().value_or("")); }
  void Next(int& value) { value = NumberOf<int>(Take().value_or("")); }
  void Next(double& value) {
    const auto& text = Take();
    value = !text                  ? kNoNumber
            : *text == "Infinity"  ? INFINITY
            : *text == "-Infinity" ? -INFINITY
                                   : NumberOf<double>(*text);
  }
  void Next(std::string& value) { value = FromStoredText(Take().value_or("")); }
  void Next(std::vector<double>& value) {
    try {
      for (const auto& entry : ParseJson(Take().value_or("")))
        value.push_back(entry.is_null() ? kNoNumber : entry.get<double>());
    } catch (const nlohmann::json::exception&) {
      throw StoreError("the store: a state in it is no list of numbers");
    }
  }
  void Next(std::optional<std::int64_t>& value) {
    const auto& text = Take();
    value = text ? std::optional(NumberOf<std::int64_t>(*text)) : std::nullopt;
  }
  template <class Number>
  void Next(OrNull<Number>& value) {
    const auto& text = Take();
    value.number = text ? NumberOf<Number>(*text) : Number{-1};
  }

  const Store::Values& values_;
  std::size_t at_ = 0;
};

std::vector<Store::Values> ValuesOf(const pqxx::result& result) {
  std::vector<Store::Values> all;
  for (const auto& row : result) {
    Store::Values& values = all.emplace_back();
    for (const auto& field : row)
      values.push_back(field.is_null() ? std::nullopt : std::optional(std::string(field.c_str(), field.size())));
  }
  return all;
}

template <class Row>
std::vector<Row> RowsOf(const pqxx::result& result) {
  std::vector<Row> rows;
  for (const Store::Values& values : ValuesOf(result)) RowReader(values).Read(rows.emplace_back());
  return rows;
}

// Months since the year 0; 0 for a time that gets no part of its own.
int MonthOf(std::int64_t utime) {
  constexpr std::int64_t kFirst = 1577836800'000000, kEnd = 4102444800'000000;  // the years 2020 to 2099
  if (utime < kFirst || utime >= kEnd) return 0;
  const auto day = std::chrono::floor<std::chrono::days>(std::chrono::microseconds(utime));
  const std::chrono::year_month_day date{std::chrono::sys_days(day)};
  return static_cast<int>(date.year()) * 12 + static_cast<int>(static_cast<unsigned>(date.month())) - 1;
}

}  // namespace

std::string ToStoredText(const std::string& text) {
  std::string stored;
  for (const char c : text) {
    const auto byte = static_cast<std::uint8_t>(c);
    if (byte >= 0x20 && byte < 0x7F && c != '\\')
      stored += c;
    else
      stored += fmt::format("\\x{:02x}", byte);
  }
  return stored;
}

std::string FromStoredText(const std::string& text) {
  std::string plain;
  for (std::size_t at = 0; at < text.size(); ++at) {
    unsigned byte = 0;
    const char* const digits = text.data() + at + 2;
    if (text[at] == '\\' && text.size() - at >= 4 && text[at + 1] == 'x' &&
        std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2) {
      plain += static_cast<char>(byte);
      at += 3;
    } else {
      plain += text[at];
    }
  }
  return plain;
}

/** A session whose tables are there. */
class Store::Connection final {
 public:
  explicit Connection(const std::string& parameters) : server(parameters) {
    pqxx::work session(server);
    session.exec(kSession);
    session.commit();
    MakeOrCheck();
  }

  pqxx::connection server;
  bool has_copies = false;

 private:
  void MakeOrCheck() {
    pqxx::work work(server);
    if (!HasTables(work)) {
      work.exec(kLock);
      if (!HasTables(work)) MakeTables(work);
    }
    const auto version = work.exec1("SELECT max(version) FROM forereach_schema")[0].as<int>();
    if (version != Database::kSchemaVersion)
      throw StoreError(
          fmt::format("the store: schema version {}, this program knows version {}: use the program that made it, or "
                      "another database",
                      version, Database::kSchemaVersion));
    work.commit();
  }

  // Read from a table: behind kLock, to_regclass would not know of what another has just made.
  static bool HasTables(pqxx::work& work) {
    return work
        .exec1(
            "SELECT EXISTS (SELECT FROM pg_tables WHERE schemaname = 'public' AND tablename = 'forereach_schema')")[0]
        .as<bool>();
  }

  static void MakeTables(pqxx::work& work) {
    work.exec(TablesSql(kDialect));
    work.exec(kAroundTables);
    work.exec(fmt::format("INSERT INTO forereach_schema VALUES ({})", Database::kSchemaVersion));
  }
};

Store::Store(const std::string& address) : parameters_(ParametersOf(address)) {}

Store::~Store() = default;

bool Store::IsAddress(const std::string& database) {
  return database.starts_with("postgresql://") || database.starts_with("postgres://");
}

auto Store::With(const auto& work) {
  const auto lost = [this](const std::string& why) {
    connection_.reset();
    return StoreAway(fmt::format("the store: {}", why));
  };
  try {
    if (!connection_) connection_ = std::make_unique<Connection>(parameters_);
    return work(*connection_);
  } catch (const StoreError&) {
    throw;
  } catch (const pqxx::broken_connection&) {
    throw lost(connection_ ? "the server was lost" : WhyNotConnected(parameters_));
  } catch (const pqxx::sql_error& error) {
    const std::string state = StateOf(error);
    if (connection_ ? !connection_->server.is_open() : state.empty()) throw lost("the server was lost");
    if (!IsAway(state)) throw StoreError(fmt::format("the store: {}", WhyServerRefuses(state)));
    throw lost(WhyServerRefuses(state));
  } catch (const pqxx::failure&) {  // the commit was not confirmed, or the connection broke in another way
    throw lost("the server was lost");
  } catch (const std::logic_error&) {  // libpqxx's, of a connection that broke between two of its calls
    throw lost("the server was lost");
  }
}

namespace {

template <class Row>
void Copy(pqxx::work& work, const char* table, const std::string& robot, const std::vector<Row>& rows) {
  pqxx::stream_to copy(work, std::string("new_") + table);
  for (const Row& row : rows) copy << RowFields(robot, row);
  copy.complete();
}

// Two logs of one name: the store can hold one of them.
void RequireSameEvents(pqxx::work& work, const char* table) {
  const pqxx::result other = work.exec(
      fmt::format("SELECT log_file, event_number FROM pg_temp.new_{0} JOIN public.{0} AS old USING (robot, log_file, "
                  "event_number, event_utime) WHERE old.event_digest <> new_{0}.event_digest LIMIT 1",
                  table));
  if (!other.empty())
    throw StoreError(
        fmt::format("the store: {}, event {}: it has another event of this number and time: two logs have one name, or "
                    "one was changed",
                    other[0][0].c_str(), other[0][1].c_str()));
}

template <class Row>
std::int64_t Add(pqxx::work& work, const char* table, const std::string& robot, const std::vector<Row>& rows) {
  if (rows.empty()) return 0;
  Copy(work, table, robot, rows);
  if constexpr (!std::is_same_v<Row, RunRow>) RequireSameEvents(work, table);
  const pqxx::result added =
      work.exec(fmt::format("INSERT INTO public.{0} SELECT * FROM pg_temp.new_{0} ON CONFLICT DO NOTHING", table));
  return static_cast<std::int64_t>(added.affected_rows());
}

// Without the robot, which stands before the columns of a row.
template <class Row>
std::vector<Row> Select(pqxx::work& work, const char* table, const std::string& robot, const std::string& log_file) {
  std::vector<Row> rows;
  for (Store::Values& values : ValuesOf(work.exec_params(
           fmt::format("SELECT * FROM {} WHERE robot = $1 AND log_file = $2 ORDER BY event_number, event_utime", table),
           ToStoredText(robot), ToStoredText(log_file)))) {
    values.erase(values.begin());
    RowReader(values).Read(rows.emplace_back());
  }
  return rows;
}

}  // namespace

// Before the transaction of the rows, which would otherwise wait for others', and they for it.
void Store::MakeMonths(Connection& connection, const Rows& rows) {
  std::set<int> months;
  Rows::ForEachTable([&](const char*, auto of_table) {
    for (const auto& row : rows.*of_table) months.insert(MonthOf(row.event.utime));
  });
  for (const int month : months) {
    if (month == 0 || months_.contains(month)) continue;
    pqxx::work work(connection.server);
    work.exec(fmt::format("SELECT forereach_month({})", month));
    work.commit();
    months_.insert(month);
  }
}

std::int64_t Store::Write(const std::string& robot, const Rows& rows, const std::vector<RunRow>& runs) {
  std::vector<RunRow> states = runs;
  for (RunRow& run : states) run.robot = robot;
  return With([&](Connection& connection) {
    MakeMonths(connection, rows);
    pqxx::work work(connection.server);
    if (!connection.has_copies) work.exec(kCopies);
    std::int64_t added = 0;
    Rows::ForEachTable([&](const char* table, auto of_table) { added += Add(work, table, robot, rows.*of_table); });
    Add(work, "run_states", robot, states);
    work.commit();
    connection.has_copies = true;
    return added;
  });
}

std::vector<RunRow> Store::Runs(const std::string& robot) {
  return With([&](Connection& connection) {
    pqxx::work work(connection.server);
    return RowsOf<RunRow>(
        work.exec_params("SELECT * FROM runs WHERE robot = $1 ORDER BY start_utime, log_file", ToStoredText(robot)));
  });
}

RowCounts Store::Count(const std::string& robot, const std::string& log_file) {
  return With([&](Connection& connection) {
    pqxx::work work(connection.server);
    const auto count = [&](const char* table) {
      return work
          .exec_params(fmt::format("SELECT count(*) FROM {} WHERE robot = $1 AND log_file = $2", table),
                       ToStoredText(robot), ToStoredText(log_file))[0][0]
          .template as<std::int64_t>();
    };
    return RowCounts{count("decisions"), count("execution_events"), count("gaps"), count("transitions")};
  });
}

Rows Store::Read(const std::string& robot, const std::string& log_file) {
  return With([&](Connection& connection) {
    pqxx::work work(connection.server);
    Rows rows;
    Rows::ForEachTable([&]<class Row>(const char* table, std::vector<Row> Rows::*of_table) {
      rows.*of_table = Select<Row>(work, table, robot, log_file);
    });
    return rows;
  });
}

std::vector<Store::OfRobot> Store::ReadTransitions(const WhichTransitions& which, const OfRobot* after, int most) {
  const std::string robot = ToStoredText(which.robot), last_robot = after ? ToStoredText(after->first) : "";
  const LogReference last = after ? after->second.event : LogReference{"", INT64_MIN, "", 0};
  return With([&](Connection& connection) {
    pqxx::work work(connection.server);
    std::vector<OfRobot> found;
    // From the last row's key on: however many rows lie before, the next ones cost the same.
    for (Values& values : ValuesOf(work.exec_params(
             "SELECT * FROM transitions WHERE ($1 = '' OR robot = $1) AND event_utime >= $2 AND event_utime < $3 AND "
             "(robot, log_file, event_number, event_utime) > ($4, $5, $6, $7) "
             "ORDER BY robot, log_file, event_number, event_utime LIMIT $8",
             robot, which.from, which.until, last_robot, ToStoredText(last.log_file), last.event_number,
             after ? last.utime : INT64_MIN, most))) {
      OfRobot& row = found.emplace_back(FromStoredText(values.at(0).value_or("")), TransitionRow{});
      values.erase(values.begin());
      RowReader(values).Read(row.second);
    }
    return found;
  });
}

std::vector<Store::Values> Store::Query(const std::string& sql) {
  return With([&](Connection& connection) {
    pqxx::work work(connection.server);
    work.exec("SET TRANSACTION READ ONLY");
    return ValuesOf(work.exec(sql));
  });
}

}  // namespace forereach
