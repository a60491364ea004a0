#include "records/row_check.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "records/export_table.h"

namespace forereach {
namespace {

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

// What is derived, with what does not follow from the log if the order of its messages is not known.
template <class Row>
Row Adjusted(Row derived, const Row&) {
  return derived;
}
DecisionRow Adjusted(DecisionRow derived, const DecisionRow& recorded) {
  if (std::isnan(derived.latency_us)) derived.latency_us = recorded.latency_us;
  if (derived.cause != "shadow") derived.shadow = recorded.shadow;
  return derived;
}

}  // namespace

// An event has at most one row of a table; of several events with one number the last one counts.
template <class Row>
void RowComparison::Compare(Table& table, const std::vector<Row>& derived, const std::vector<Row>& recorded) {
  const auto number_of = [](const Row& row) { return row.event.event_number; };
  for (const Row& row : derived) {
    const std::int64_t event = number_of(row);
    if (event < 0) continue;
    table.derived.Insert(event);
    table.differences.erase(event);
    const auto found = std::ranges::lower_bound(recorded, event, {}, number_of);
    if (found == recorded.end() || number_of(*found) != event) {
      table.unrecorded.insert(event);
      continue;
    }
    const Cells known = CellsOfColumns(*found);
    Difference difference{DescribeDifference(known, CellsOfColumns(row)),
                          DescribeDifference(known, CellsOfColumns(Adjusted(row, *found)))};
    if (grounds_.misses_candidates) difference.known_order = difference.unknown_order;
    if (!difference.known_order.empty()) table.differences.emplace(event, std::move(difference));
  }
}

void RowComparison::Take(const Rows& derived, const Rows& recorded) {
  Compare(decisions_, derived.decisions, recorded.decisions);
  Compare(events_, derived.events, recorded.events);
  Compare(transitions_, derived.transitions, recorded.transitions);
}

void RowComparison::TakeRecorded(const Rows& recorded) {
  const auto take = [](Table& table, const auto& rows) {
    const std::string none = "no such row follows from it", second = "it has a second row";
    std::int64_t before = -1;
    for (const auto& row : rows) {
      const std::int64_t event = row.event.event_number;
      if (event < 0) continue;
      if (!table.derived.Contains(event)) table.differences.emplace(event, Difference{none, none});
      if (event == std::exchange(before, event)) table.differences.insert_or_assign(event, Difference{second, second});
    }
  };
  take(decisions_, recorded.decisions);
  take(events_, recorded.events);
  take(transitions_, recorded.transitions);
}

std::vector<std::string> RowComparison::Finish() const {
  std::vector<std::string> sentences;
  for (const auto& [name, table] :
       {std::pair("decisions", &decisions_), {"execution_events", &events_}, {"transitions", &transitions_}}) {
    const auto say = [&, name = name](std::int64_t event, const std::string& what) {
      if (!what.empty() && !grounds_.damaged.contains(event))
        sentences.push_back(fmt::format("{}, event {}: {}", name, event, what));
    };
    for (const auto& [event, how] : table->differences)
      say(event, grounds_.knows_order ? how.known_order : how.unknown_order);
    for (const std::int64_t event : table->unrecorded)
      if (event < grounds_.end) say(event, "its row is missing");
  }
  return sentences;
}

}  // namespace forereach
