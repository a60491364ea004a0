#include "records/export_table.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <nlohmann/json.hpp>

#include "forereach/numerics/text.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/grounds.h"
#include "lcmtypes/names.h"
#include "lcmtypes/printable.h"
#include "task/json_text.h"

namespace forereach {
namespace {

constexpr int kInputs = 8;
constexpr const char* kInputNames[kInputs] = {"u0", "u1", "u2", "u3", "u4", "u5", "u6", "u7"};

// Numbers that count from 0, and are -1 where none applies.
Cell Index(std::int64_t value) { return value < 0 ? Cell() : Cell(value); }
Cell TextOrNone(const std::string& text) { return text.empty() ? Cell() : Cell(text); }

void Add(Cells& cells, Cells more) { std::ranges::move(more, std::back_inserter(cells)); }

Cells ReferenceOf(const std::string& robot, const LogReference& event) {
  return {{"robot", robot}, {"log_file", event.log_file}, {"event_number", Index(event.event_number)}};
}

bool IsNamed(const Cells::value_type& cell, std::string_view name) { return cell.first == name; }

// All of a row but the event's time.
Cells ExportedColumns(const std::string& robot, const auto& row) {
  Cells cells = CellsOfColumns(row);
  cells.insert(cells.begin(), {"robot", robot});
  std::erase_if(cells, [](const auto& cell) { return IsNamed(cell, "event_utime"); });
  cells.back().second = TextOrNone(row.event.digest);
  return cells;
}

Cells CandidateCells(const candidate_plan_t* candidate) {
  const auto number = [&](std::int64_t value) { return candidate ? Cell(value) : Cell(); };
  const auto numbers = [&](const double(&values)[16]) {
    return candidate && HasCounts(*candidate) ? Cell(std::vector(values, values + candidate->num_states)) : Cell();
  };
  static const candidate_plan_t none{};
  const candidate_plan_t& given = candidate ? *candidate : none;
  return {{"start_utime", number(given.start_utime)},
          {"step_us", number(given.step_us)},
          {"num_states", number(given.num_states)},
          {"num_inputs", number(given.num_inputs)},
          {"num_steps", number(given.num_steps)},
          {"progress_steps", number(given.progress_steps)},
          {"initial_center", numbers(given.initial_center)},
          {"initial_half_width", numbers(given.initial_half_width)}};
}

// What a text of a recording may not begin with in a spreadsheet: it would be computed.
bool IsFormula(std::string_view text) { return text.find_first_of("=+-@") == 0; }

std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted(1, '"');
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + '"';
}

struct AsCsv {
  std::string operator()(std::monostate) const { return ""; }
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(double value) const { return std::isfinite(value) ? ToText(value) : ""; }
  std::string operator()(const std::string& any) const {
    const std::string text = Printable(any);
    return Quoted(IsFormula(text) ? "'" + text : text);
  }
  std::string operator()(const std::vector<double>& values) const {
    std::string text;
    for (const double value : values) {
      if (!text.empty()) text += ' ';
      text += ToText(value);
    }
    return text;
  }
};

struct AsJson {
  using Json = nlohmann::ordered_json;
  Json operator()(std::monostate) const { return nullptr; }
  Json operator()(double value) const { return std::isfinite(value) ? Json(value) : Json(nullptr); }
  Json operator()(const std::string& text) const { return Printable(text); }
  Json operator()(const auto& value) const { return value; }
};

}  // namespace

bool HasCounts(const candidate_plan_t& candidate) {
  return 1 <= candidate.num_states && candidate.num_states <= 16 && 1 <= candidate.num_inputs &&
         candidate.num_inputs <= 8 && 1 <= candidate.num_steps && candidate.num_steps <= 128;
}

Cells CellsOf(const std::string& robot, const DecisionRow& row, const candidate_plan_t* candidate) {
  Cells cells = ExportedColumns(robot, row);
  Cells added = CandidateCells(candidate);
  cells.insert(std::ranges::find_if(cells, [](const auto& cell) { return IsNamed(cell, "message"); }),
               std::make_move_iterator(added.begin()), std::make_move_iterator(added.end()));
  return cells;
}

Cells CellsOfControl(const std::string& robot, const DecisionRow& row, const candidate_plan_t& candidate, int step) {
  Cells cells = ReferenceOf(robot, row.event);
  Add(cells, {{"source", row.source}, {"plan_id", row.plan_id}, {"step", step}});
  for (int i = 0; i < kInputs; ++i) {
    Cell& cell = cells.emplace_back(kInputNames[i], std::monostate()).second;
    if (i < candidate.num_inputs) cell = candidate.control[step][i];
  }
  return cells;
}

Cells CellsOf(const std::string& robot, const withdrawal_t& withdrawal, const LogReference& event) {
  Cells cells = ReferenceOf(robot, event);
  Add(cells, {{"utime", withdrawal.utime},
              {"sequence", withdrawal.sequence},
              {"source", GetText(withdrawal.source)},
              {"plan_id", withdrawal.plan_id},
              {"cause", std::string(WithdrawalName(withdrawal.cause))},
              {"first_step", Index(withdrawal.first_step)},
              {"valid_steps", withdrawal.valid_steps},
              {"step", Index(withdrawal.step)},
              {"obstacle", Index(withdrawal.obstacle)},
              {"margin", withdrawal.margin},
              {"threshold", withdrawal.threshold},
              {"message", GetText(withdrawal.message)},
              {"plan_digest", ToHex(GetDigest(withdrawal.plan_digest))},
              {"certificate_digest", ToHex(GetDigest(withdrawal.certificate_digest))}});
  const Grounds grounds = GroundsOf(withdrawal);
  for (std::size_t i = 0; i < kGrounds.size(); ++i)
    cells.emplace_back(kGroundColumns[i], ToHex(grounds.*kGrounds[i].member));
  cells.emplace_back("event_digest", TextOrNone(event.digest));
  return cells;
}

Cells CellsOf(const std::string& robot, const EventRow& row) { return ExportedColumns(robot, row); }

Cells CellsOf(const std::string& robot, const GapRow& row) {
  Cells cells = ExportedColumns(robot, row);
  for (auto& cell : cells)
    if (IsNamed(cell, "source")) cell.second = TextOrNone(row.source);
  return cells;
}

std::string CsvHeader(const Cells& cells) {
  std::string line;
  for (const auto& [name, cell] : cells) {
    if (!line.empty()) line += ',';
    line += name;
  }
  line += '\n';
  return line;
}

std::string CsvLine(const Cells& cells) {
  std::string line;
  bool is_first = true;
  for (const auto& [name, cell] : cells) {
    if (!std::exchange(is_first, false)) line += ',';
    line += std::visit(AsCsv(), cell);
  }
  line += '\n';
  return line;
}

std::string JsonLine(std::string_view record, const Cells& cells, const candidate_plan_t* controls) {
  nlohmann::ordered_json object{{"record", record}};
  for (const auto& [name, cell] : cells) object[name] = std::visit(AsJson(), cell);
  if (controls && HasCounts(*controls)) {
    auto& steps = object["controls"] = nlohmann::ordered_json::array();
    for (int t = 0; t < controls->num_steps; ++t)
      steps.push_back(std::vector(controls->control[t], controls->control[t] + controls->num_inputs));
  }
  return JsonText(object) + '\n';
}

}  // namespace forereach
