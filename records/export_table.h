/** The columns of an export, and what CSV and JSON Lines make of them. docs/export.md explains each column. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "forereach/candidate_plan_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "records/rows.h"
#include "records/schema.h"

namespace forereach {

/** Whether the counts of a candidate are within the bounds of its type: 1 to 16 states, 1 to 8 inputs, 1 to 128 steps.
 */
[[nodiscard]] bool HasCounts(const candidate_plan_t& candidate);

/** A value of a record. None: it does not apply. */
using Cell = std::variant<std::monostate, std::int64_t, double, std::string, std::vector<double>>;
using Cells = std::vector<std::pair<const char*, Cell>>;

/** What each column of a row has, in the order of its table. */
[[nodiscard]] Cells CellsOfColumns(const auto& row) {
  const auto cell_of = [](const auto& value) -> Cell {
    if constexpr (requires { value.number; })
      return value.number < 0 ? Cell() : Cell(value.number);
    else
      return value;
  };
  Cells cells;
  std::apply([&](const auto&... column) { (cells.emplace_back(column.name, cell_of(column.value)), ...); },
             ColumnsOf(row));
  return cells;
}

/** @param robot whose log it is (records/run_logs.h). @param candidate null if it is not known. */
[[nodiscard]] Cells CellsOf(const std::string& robot, const DecisionRow& row, const candidate_plan_t* candidate);
[[nodiscard]] Cells CellsOf(const std::string& robot, const withdrawal_t& withdrawal, const LogReference& event);
[[nodiscard]] Cells CellsOf(const std::string& robot, const EventRow& row);
[[nodiscard]] Cells CellsOf(const std::string& robot, const GapRow& row);
/** One control of a candidate with as many as `step`. */
[[nodiscard]] Cells CellsOfControl(const std::string& robot, const DecisionRow& row, const candidate_plan_t& candidate,
                                   int step);

/** The columns' names, as a line of a CSV file with its end. */
[[nodiscard]] std::string CsvHeader(const Cells& cells);

/** A line of a CSV file (RFC 4180, with "\n" as its end). A number that is not finite is empty. Several numbers are
separated by spaces. A text that a spreadsheet would take for a formula has an apostrophe before it. */
[[nodiscard]] std::string CsvLine(const Cells& cells);

/** A line of a JSON Lines file: an object with "record" and the cells. A number that is not finite is null.
@param controls one array for each step; none if null. */
[[nodiscard]] std::string JsonLine(std::string_view record, const Cells& cells,
                                   const candidate_plan_t* controls = nullptr);

}  // namespace forereach
