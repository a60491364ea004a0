/** The tables of decisions, written once for both engines: SQLite (records/database.h) and PostgreSQL (fleet/store.h).
 */
#pragma once

#include <cstdint>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "records/database.h"
#include "records/rows.h"

namespace forereach {

/** Both engines take these types: eight bytes each, in SQLite by the words INT and DOUB in them. */
inline constexpr const char* kTables = R"sql(
  CREATE TABLE {runs} (
    log_file TEXT NOT NULL, start_utime BIGINT NOT NULL, end_utime BIGINT,
    events BIGINT NOT NULL DEFAULT 0, recovered TEXT NOT NULL DEFAULT '', continues TEXT NOT NULL DEFAULT '',
    log_deleted_utime BIGINT, robot TEXT NOT NULL DEFAULT '', {unique} ({run_key}));
  CREATE TABLE decisions ({robot}
    log_file TEXT NOT NULL, event_number BIGINT NOT NULL, event_utime BIGINT NOT NULL,
    utime BIGINT NOT NULL, candidate_utime BIGINT NOT NULL, sequence BIGINT NOT NULL,
    source TEXT NOT NULL, plan_id BIGINT NOT NULL, outcome TEXT NOT NULL, cause TEXT NOT NULL,
    step BIGINT, coordinate BIGINT, obstacle BIGINT, first_observation BIGINT, second_observation BIGINT,
    margin DOUBLE PRECISION, threshold DOUBLE PRECISION, elapsed_us DOUBLE PRECISION, latency_us DOUBLE PRECISION,
    shadow BIGINT, message TEXT NOT NULL,
    plan_digest TEXT NOT NULL, config_digest TEXT NOT NULL, model_digest TEXT NOT NULL,
    declaration_digest TEXT NOT NULL, observations_digest TEXT NOT NULL, obstacles_digest TEXT NOT NULL,
    event_digest TEXT NOT NULL, {unique} ({key})){partitioned};
  CREATE TABLE execution_events ({robot}
    log_file TEXT NOT NULL, event_number BIGINT NOT NULL, event_utime BIGINT NOT NULL,
    utime BIGINT NOT NULL, sequence BIGINT NOT NULL, plan_id BIGINT, kind TEXT NOT NULL,
    step BIGINT, coordinate BIGINT, state TEXT NOT NULL, value DOUBLE PRECISION, message TEXT NOT NULL,
    event_digest TEXT NOT NULL, {unique} ({key})){partitioned};
  CREATE TABLE gaps ({robot}
    log_file TEXT NOT NULL, event_number BIGINT, event_utime BIGINT NOT NULL,
    channel TEXT NOT NULL, source TEXT NOT NULL,
    expected BIGINT, got BIGINT, lost BIGINT NOT NULL, utime BIGINT NOT NULL, reason TEXT NOT NULL,
    event_digest TEXT NOT NULL, {unique} ({gap_key})){partitioned};
  CREATE TABLE transitions ({robot}
    log_file TEXT NOT NULL, event_number BIGINT NOT NULL, event_utime BIGINT NOT NULL,
    utime BIGINT NOT NULL, sequence BIGINT NOT NULL, duration_us BIGINT NOT NULL,
    state TEXT NOT NULL, input TEXT NOT NULL, next_state TEXT NOT NULL,
    event_digest TEXT NOT NULL, {unique} ({key})){partitioned};
)sql";

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
};

/** The statements that make them, of version Database::kSchemaVersion. Tables of another version are refused: logs make
them anew (ingest, and the logger where its database is gone). */
inline std::string TablesSql(const Dialect& dialect) {
  return fmt::format(fmt::runtime(kTables), fmt::arg("runs", dialect.runs), fmt::arg("run_key", dialect.run_key),
                     fmt::arg("robot", dialect.robot), fmt::arg("key", dialect.key),
                     fmt::arg("gap_key", dialect.gap_key), fmt::arg("unique", dialect.unique),
                     fmt::arg("partitioned", dialect.partitioned));
}

/** A column that is NULL where the number is -1. */
template <class Number>
struct OrNull {
  Number& number;
};
template <class Number>
OrNull(Number&) -> OrNull<Number>;

/** The columns of a row, in the order of its table or query. */
auto ColumnsOf(auto& row) {
  using Row = std::remove_const_t<std::remove_reference_t<decltype(row)>>;
  if constexpr (std::is_same_v<Row, DecisionRow>)
    return std::tuple_cat(std::tie(row.event.log_file, row.event.event_number, row.event.utime, row.utime,
                                   row.candidate_utime, row.sequence, row.source, row.plan_id, row.outcome, row.cause),
                          std::tuple(OrNull{row.step}, OrNull{row.coordinate}, OrNull{row.obstacle},
                                     OrNull{row.first_observation}, OrNull{row.second_observation}),
                          std::tie(row.margin, row.threshold, row.elapsed_us, row.latency_us),
                          std::tuple(OrNull{row.shadow}),
                          std::tie(row.message, row.plan_digest, row.grounds, row.event.digest));
  else if constexpr (std::is_same_v<Row, EventRow>)
    return std::tuple_cat(
        std::tie(row.event.log_file, row.event.event_number, row.event.utime, row.utime, row.sequence),
        std::tuple(OrNull{row.plan_id}), std::tie(row.kind), std::tuple(OrNull{row.step}, OrNull{row.coordinate}),
        std::tie(row.state, row.value, row.message, row.event.digest));
  else if constexpr (std::is_same_v<Row, GapRow>)
    return std::tuple_cat(std::tie(row.event.log_file), std::tuple(OrNull{row.event.event_number}),
                          std::tie(row.event.utime, row.channel, row.source),
                          std::tuple(OrNull{row.expected}, OrNull{row.got}),
                          std::tie(row.lost, row.utime, row.reason, row.event.digest));
  else if constexpr (std::is_same_v<Row, TransitionRow>)
    return std::tie(row.event.log_file, row.event.event_number, row.event.utime, row.utime, row.sequence,
                    row.duration_us, row.state, row.input, row.next_state, row.event.digest);
  else if constexpr (std::is_same_v<Row, RunRow>)
    return std::tie(row.log_file, row.start_utime, row.end_utime, row.events, row.recovered, row.continues,
                    row.log_deleted_utime, row.robot);
  else if constexpr (std::is_same_v<Row, std::pair<std::string, std::int64_t>>)
    return std::tie(row.first, row.second);
  else
    return std::tie(row);
}

}  // namespace forereach
