/** The tables of decisions, written once for both engines: SQLite (records/database.h) and PostgreSQL (fleet/store.h).
 */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "records/database.h"
#include "records/rows.h"

namespace forereach {

/** A column that is NULL where the number is -1. */
template <class Number>
struct OrNull {
  Number& number;
};

/** A column of a table or query: its name, and what a row has in it: Value& or OrNull. */
template <class Value>
struct Column {
  const char* name;
  Value value;
};
template <class Value>
Column<Value&> Named(const char* name, Value& value) {
  return {name, value};
}
template <class Number>
Column<OrNull<Number>> NamedOrNull(const char* name, Number& number) {
  return {name, {number}};
}

/** Of kGrounds. */
inline constexpr std::array kGroundColumns{"config_digest", "model_digest", "declaration_digest", "observations_digest",
                                           "obstacles_digest"};

/** Columns named as the members of a row: ", Named(..)" for each member; the 0 before takes the first comma. */
#define FOREREACH_COLUMN(member) , Named(#member, row.member)
#define FOREREACH_COLUMN_OR_NULL(member) , NamedOrNull(#member, row.member)
#define FOREREACH_COLUMNS(...) AsTuple(0 NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(FOREREACH_COLUMN, __VA_ARGS__)))
#define FOREREACH_COLUMNS_OR_NULL(...) \
  AsTuple(0 NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(FOREREACH_COLUMN_OR_NULL, __VA_ARGS__)))
auto AsTuple(int, auto... columns) { return std::tuple(columns...); }

/** Those of an event, and between its number and its digest those that are made of it. */
auto ColumnsOfEvent(auto& event, const auto&... made) {
  return std::tuple_cat(std::tuple(Named("log_file", event.log_file), Named("event_number", event.event_number),
                                   Named("event_utime", event.utime)),
                        made..., std::tuple(Named("event_digest", event.digest)));
}

/** The columns of a row, in the order of its table or query: for databases, exports and `forereach check-log`. */
auto ColumnsOf(auto& row) {
  using Row = std::remove_const_t<std::remove_reference_t<decltype(row)>>;
  if constexpr (std::is_same_v<Row, DecisionRow>)
    return ColumnsOfEvent(row.event,
                          FOREREACH_COLUMNS(utime, candidate_utime, sequence, source, plan_id, outcome, cause),
                          FOREREACH_COLUMNS_OR_NULL(step, coordinate, obstacle, first_observation, second_observation),
                          FOREREACH_COLUMNS(margin, threshold, elapsed_us, latency_us),
                          FOREREACH_COLUMNS_OR_NULL(shadow), FOREREACH_COLUMNS(message, plan_digest),
                          std::tuple(Named(kGroundColumns[0], row.grounds[0]), Named(kGroundColumns[1], row.grounds[1]),
                                     Named(kGroundColumns[2], row.grounds[2]), Named(kGroundColumns[3], row.grounds[3]),
                                     Named(kGroundColumns[4], row.grounds[4])));
  else if constexpr (std::is_same_v<Row, EventRow>)
    return ColumnsOfEvent(row.event, FOREREACH_COLUMNS(utime, sequence), FOREREACH_COLUMNS_OR_NULL(plan_id),
                          FOREREACH_COLUMNS(kind), FOREREACH_COLUMNS_OR_NULL(step, coordinate),
                          FOREREACH_COLUMNS(state, value, message));
  else if constexpr (std::is_same_v<Row, GapRow>)
    return std::tuple_cat(
        std::tuple(Named("log_file", row.event.log_file), NamedOrNull("event_number", row.event.event_number),
                   Named("event_utime", row.event.utime)),
        FOREREACH_COLUMNS(channel, source), FOREREACH_COLUMNS_OR_NULL(expected, got),
        FOREREACH_COLUMNS(lost, utime, reason), std::tuple(Named("event_digest", row.event.digest)));
  else if constexpr (std::is_same_v<Row, TransitionRow>)
    return ColumnsOfEvent(row.event, FOREREACH_COLUMNS(utime, sequence, duration_us, state, input, next_state));
  else if constexpr (std::is_same_v<Row, RunRow>)
    return FOREREACH_COLUMNS(log_file, start_utime, end_utime, events, recovered, continues, log_deleted_utime, robot);
  else if constexpr (std::is_same_v<Row, std::pair<std::string, std::int64_t>>)
    return FOREREACH_COLUMNS(first, second);
  else
    return std::tuple(Named("", row));
}

/** In what the engines differ. SQLite's database is one robot's, and its rows change with it; in PostgreSQL several
robots add rows, and none changes. */
struct Dialect {
  const char* runs;
  const char* run_key;
  const char* robot;  ///< The column that tells whose row it is.
  const char* key;
  const char* gap_key;
  const char* unique;
  const char* partitioned;

  template <class Row>
  [[nodiscard]] constexpr const char* KeyOf() const {
    return std::is_same_v<Row, GapRow> ? gap_key : key;
  }
};

// Both engines take these types: eight bytes each, in SQLite by the words INT and DOUB in them.
constexpr const char* TypeOf(std::int64_t) { return "BIGINT NOT NULL"; }
constexpr const char* TypeOf(int) = delete;
constexpr const char* TypeOf(double) { return "DOUBLE PRECISION"; }
constexpr const char* TypeOf(const auto&) { return "TEXT NOT NULL"; }
template <class Number>
constexpr const char* TypeOf(OrNull<Number>) {
  return "BIGINT";
}

/** The statements that make the tables, of version Database::kSchemaVersion. Tables of another version are refused:
logs make them anew (ingest, and the logger where its database is gone). */
inline std::string TablesSql(const Dialect& dialect) {
  std::string sql = fmt::format(
      R"sql(CREATE TABLE {} (
    log_file TEXT NOT NULL, start_utime BIGINT NOT NULL, end_utime BIGINT,
    events BIGINT NOT NULL DEFAULT 0, recovered TEXT NOT NULL DEFAULT '', continues TEXT NOT NULL DEFAULT '',
    log_deleted_utime BIGINT, robot TEXT NOT NULL DEFAULT '', {} ({}));)sql",
      dialect.runs, dialect.unique, dialect.run_key);
  Rows::ForEachTable([&]<class Row>(const char* table, std::vector<Row> Rows::*) {
    const Row row;
    sql += fmt::format("CREATE TABLE {} ({}", table, dialect.robot);
    std::apply(
        [&](const auto&... column) { ((sql += fmt::format("{} {}, ", column.name, TypeOf(column.value))), ...); },
        ColumnsOf(row));
    sql += fmt::format("{} ({})){};", dialect.unique, dialect.KeyOf<Row>(), dialect.partitioned);
  });
  return sql;
}

#undef FOREREACH_COLUMNS_OR_NULL
#undef FOREREACH_COLUMNS
#undef FOREREACH_COLUMN_OR_NULL
#undef FOREREACH_COLUMN

}  // namespace forereach
