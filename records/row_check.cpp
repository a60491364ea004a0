#include "records/row_check.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "records/export_table.h"

namespace forereach {
namespace {

Cells ExportedCells(const DecisionRow& row) { return CellsOf("", row, nullptr); }
Cells ExportedCells(const auto& row) { return CellsOf("", row); }
Cells CellsOfRow(const auto& row) {
  Cells cells = ExportedCells(row);
  cells.emplace_back("event_utime", row.event.utime);
  return cells;
}

std::string DescribeCell(const Cells::value_type& cell) {
  std::string text = CsvLine(Cells{cell});
  text.pop_back();
  return text.empty() ? "nothing" : text;
}

// The columns in which they differ. A number that is not finite is none.
std::string DescribeDifference(const Cells& recorded, const Cells& derived) {
  std::string text;
  for (std::size_t i = 0; i < recorded.size(); ++i)
    if (JsonLine("", Cells{recorded[i]}) != JsonLine("", Cells{derived[i]}))
      text += fmt::format("{}{} {}, by its event {}", text.empty() ? "" : "; ", recorded[i].first,
                          DescribeCell(recorded[i]), DescribeCell(derived[i]));
  return text;
}

class RowComparison {
 public:
  explicit RowComparison(const RowGrounds& grounds) : grounds_(grounds) {}

  // An event has at most one row of a table.
  template <class Row>
  void Compare(const char* table, const std::vector<Row>& recorded, const std::vector<Row>& derived) {
    std::map<std::int64_t, const Row*> missing;
    for (const Row& row : derived)
      if (IsCompared(row)) missing[row.event.event_number] = &row;
    for (const Row& row : recorded) {
      if (!IsCompared(row)) continue;
      const std::int64_t event = row.event.event_number;
      const auto again = missing.extract(event);
      const std::string how = again ? DescribeDifference(CellsOfRow(row), CellsOfRow(Adjusted(*again.mapped(), row)))
                                    : "no such row follows from it";
      if (!how.empty()) Say(table, event, how);
    }
    for (const auto& [event, row] : missing)
      if (event < grounds_.end) Say(table, event, "its row is missing");
  }

  std::vector<std::string> sentences;

 private:
  void Say(const char* table, std::int64_t event, const std::string& what) {
    sentences.push_back(fmt::format("{}, event {}: {}", table, event, what));
  }

  [[nodiscard]] bool IsCompared(const auto& row) const {
    return row.event.event_number >= 0 && !grounds_.damaged.contains(row.event.event_number);
  }

  // What is derived, with what does not follow from the log as it is recorded.
  [[nodiscard]] DecisionRow Adjusted(DecisionRow derived, const DecisionRow& recorded) const {
    if (std::isnan(derived.latency_us) && (!grounds_.knows_order || grounds_.misses_candidates))
      derived.latency_us = recorded.latency_us;
    return derived;
  }
  [[nodiscard]] static const EventRow& Adjusted(const EventRow& derived, const EventRow&) { return derived; }

  const RowGrounds& grounds_;
};

}  // namespace

std::vector<std::string> CompareRows(const Rows& recorded, const Rows& derived, const RowGrounds& grounds) {
  RowComparison comparison(grounds);
  comparison.Compare("decisions", recorded.decisions, derived.decisions);
  comparison.Compare("execution_events", recorded.events, derived.events);
  return std::move(comparison.sentences);
}

}  // namespace forereach
