#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <span>

#include "forereach/transition_t.hpp"
#include "lcmtypes/codec.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "records/export_table.h"
#include "records/log_survey.h"
#include "records/log_tasks.h"
#include "records/record_reader.h"
#include "records/run_logs.h"

namespace forereach {
namespace {

Cells CellsOf(const transition_t& step) {
  const auto numbers = [](const double* first, int count, std::size_t most) {
    return std::vector<double>(first, first + std::clamp<std::ptrdiff_t>(count, 0, static_cast<std::ptrdiff_t>(most)));
  };
  return {{"utime", step.utime},
          {"duration_us", step.duration_us},
          {"state", numbers(step.state, step.num_states, std::size(step.state))},
          {"input", numbers(step.input, step.num_inputs, std::size(step.input))},
          {"next_state", numbers(step.next_state, step.num_states, std::size(step.next_state))}};
}

// One kind of records, as the columns of `forereach export`; of transitions, those of their messages.
class Table final : public RecordUser {
 public:
  enum class Of { kDecisions, kWithdrawals, kExecutions, kGaps, kTransitions };

  Table(Of of, std::string robot, std::string steps) : of_(of), robot_(std::move(robot)), steps_(std::move(steps)) {}

  void OnMessage(const LogEvent& event) override {
    if (of_ != Of::kTransitions || event.channel != steps_) return;
    if (const auto step = Decoded<transition_t>(event.message())) rows.push_back(CellsOf(*step));
  }
  void OnDecision(const DecisionRow& row, const candidate_plan_t* candidate) override {
    if (of_ == Of::kDecisions) rows.push_back(CellsOf(robot_, row, candidate));
  }
  void OnWithdrawn(const withdrawal_t& withdrawal, const LogReference& event) override {
    if (of_ == Of::kWithdrawals) rows.push_back(CellsOf(robot_, withdrawal, event));
  }
  void OnExecution(const EventRow& row) override {
    if (of_ == Of::kExecutions) rows.push_back(CellsOf(robot_, row));
  }
  void OnGap(const GapRow& row) override {
    if (of_ == Of::kGaps) rows.push_back(CellsOf(robot_, row));
  }

  std::vector<Cells> rows;

 private:
  const Of of_;
  const std::string robot_, steps_;
};

Cells NamesOf(Table::Of of) {
  switch (of) {
    case Table::Of::kDecisions: return CellsOf("", DecisionRow{}, nullptr);
    case Table::Of::kWithdrawals: return CellsOf("", withdrawal_t{}, LogReference{});
    case Table::Of::kExecutions: return CellsOf("", EventRow{});
    case Table::Of::kTransitions: return CellsOf(transition_t{});
    case Table::Of::kGaps: break;
  }
  return CellsOf("", GapRow{});
}

struct Log {
  std::vector<RunLogs> runs;
  std::vector<std::string> missing;
  std::string config;
  LogKey key;
};

Log OpenLog(const fs::path& path, const fs::path& config, const fs::path& key, bool unchecked) {
  NamedRuns named = RunsNamedBy({path.string()}, 1);
  for (const RunLogs& run : named.runs) {
    for (const RunRow& row : run.missing) named.missing.push_back(WhyMissing(row));
    if (!run.logs.empty()) RequireLogs(run.logs);
  }
  return {std::move(named.runs), std::move(named.missing), config, {key, unchecked}};
}

std::vector<Cells> Read(const Log& log, Table::Of of, LogDamage& damage, PassedOver& passed_over) {
  std::vector<Cells> rows;
  for (const RunLogs& run : log.runs) {
    if (run.logs.empty()) continue;
    const BusOptions channels = ChannelsOf(run.logs, log.config, log.key);
    Table table(of, run.robot, channels.transition);
    RecordReader reader(channels, table);
    reader.Read(run.logs);
    damage += reader.damage();
    passed_over += reader.passed_over();
    std::ranges::move(table.rows, std::back_inserter(rows));
  }
  return rows;
}

// Integers stay integers as long as each row has one; texts and lists are objects.
py::array ColumnOf(const std::vector<Cells>& rows, std::size_t column, const Cells& of_none) {
  bool has_objects = false, has_reals = false;
  for (const Cells& row : rows.empty() ? std::span(&of_none, 1) : std::span(rows)) {
    const Cell& cell = row[column].second;
    has_objects |= std::holds_alternative<std::string>(cell) || std::holds_alternative<std::vector<double>>(cell);
    has_reals |= std::holds_alternative<double>(cell) || std::holds_alternative<std::monostate>(cell);
  }
  py::list values;
  for (const Cells& row : rows) values.append(py::cast(row[column].second));
  const char* type = has_objects ? "O" : has_reals ? "f8" : "i8";
  if (!has_objects) return py::module_::import("numpy").attr("array")(values, type);
  py::array array(py::dtype("O"), std::vector<py::ssize_t>{static_cast<py::ssize_t>(rows.size())});
  for (std::size_t i = 0; i < rows.size(); ++i) array[py::int_(i)] = values[i];
  return array;
}

py::dict Columns(const Log& log, Table::Of of) {
  LogDamage damage;
  PassedOver passed_over;
  const std::vector<Cells> rows = [&] {
    const py::gil_scoped_release release;
    return Read(log, of, damage, passed_over);
  }();
  const auto warn = [](const std::string& text) {
    if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 1) < 0) throw py::error_already_set();
  };
  for (const std::string& missing : log.missing) warn(missing);
  if (damage.places > 0)
    warn("damaged in " + std::to_string(damage.places) + " places, " + std::to_string(damage.bytes) +
         " bytes; everything else was read");
  if (const std::string text = DescribePassedOver(passed_over); !text.empty()) warn("the log was read" + text);
  py::dict columns;
  const Cells names = NamesOf(of);
  for (std::size_t i = 0; i < names.size(); ++i) columns[names[i].first] = ColumnOf(rows, i, names);
  return columns;
}

}  // namespace

void BindLog(py::module_& module) {
  py::class_<Log> log(module, "Log",
                      R"(Recorded runs. Each table is a dict of equally long columns, for pandas.DataFrame.

The columns are those of `forereach export --format csv`; docs/export.md explains each. What is missing, damaged or not
authentic is a UserWarning.)");
  log.def(py::init(&OpenLog), py::arg("path"), py::arg("config") = "", py::arg("key") = "",
          py::arg("unchecked") = false,
          R"(path: an event log, a database, or a directory of runs.

config: the task file of the recording, by default the one that the logger kept. key: as of `forereach export --key`;
unchecked: takes every message for authentic.)");
  const auto table = [&](const char* name, Table::Of of, const char* what) {
    log.def(
        name, [of](const Log& self) { return Columns(self, of); }, what);
  };
  table("decisions", Table::Of::kDecisions, "A row a decision, with its candidate. Times in microseconds.");
  table("withdrawals", Table::Of::kWithdrawals, "A row a withdrawal.");
  table("executions", Table::Of::kExecutions, "A row an event of the robot.");
  table(
      "transitions", Table::Of::kTransitions,
      "A row an executed step, also one that the certifier refused to learn, with lists `state`, `input` and "
      "`next_state`. Task(..., data=(z, x_next, dt_error)) takes them stacked; dt_error is |duration_us / 1e6 - dt| + "
      "1e-6, and has to be below dt / 2.");
  table("gaps", Table::Of::kGaps, "A row a gap in a stream of messages.");
}

}  // namespace forereach
