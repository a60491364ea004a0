#include "fleet/ingest.h"

#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "records/event_log.h"
#include "records/interpreter.h"
#include "records/log_tasks.h"

namespace forereach {
namespace {

constexpr int kRowsAtOnce = 10'000;  // of each table, in one transaction

bool IsOf(const Shard& shard, std::int64_t event_number) {
  return (event_number < 0 ? 0 : event_number % shard.count) == shard.index;
}

template <class Row>
void KeepOf(const Shard& shard, std::vector<Row>& rows) {
  std::erase_if(rows, [&](const Row& row) { return !IsOf(shard, row.event.event_number); });
}

void Count(const Rows& rows, Ingested& sum) {
  sum.decisions += std::ssize(rows.decisions);
  sum.events += std::ssize(rows.events);
  sum.gaps += std::ssize(rows.gaps);
  sum.transitions += std::ssize(rows.transitions);
}

void RequireRobot(const std::string& robot, const std::string& log) {
  if (robot.empty())
    throw StoreError(
        fmt::format("{}: says not whose it is, since its logger had no keys: name the robot with --robot", log));
}

}  // namespace

Ingested& Ingested::operator+=(const Ingested& more) {
  logs += more.logs;
  decisions += more.decisions;
  events += more.events;
  gaps += more.gaps;
  transitions += more.transitions;
  added += more.added;
  return *this;
}

DatabaseIngest::DatabaseIngest(std::string path, Store& store, const IngestOptions& options)
    : path_(std::move(path)), store_(store), options_(options) {
  Open();
}

void DatabaseIngest::Open() {
  database_ = std::make_unique<Database>(path_);
  marks_ = {};
  runs_.clear();
  was_there_.clear();
}

Ingested DatabaseIngest::Send() {
  if (database_->FindDisplaced()) Open();
  Ingested sum;
  const std::vector<RunRow> runs = database_->Runs();  // before the rows: an ended run has all of its rows
  LearnRuns();
  while (true) {
    RowMarks next = marks_;
    Rows rows = database_->ReadNext(next, kRowsAtOnce);
    if (rows.empty()) break;
    for (const auto& [robot, of_robot] : ToSend(std::move(rows))) {
      sum.added += store_.Write(robot, of_robot);
      Count(of_robot, sum);
    }
    marks_ = next;
  }
  SendStates(runs, sum);
  return sum;
}

void DatabaseIngest::LearnRuns() {
  for (RunRow& run : database_->Runs()) {
    if (run.robot.empty()) run.robot = options_.robot;
    runs_[run.log_file] = std::move(run);
  }
}

const std::string& DatabaseIngest::RobotOf(const std::string& log_file) {
  if (!runs_.contains(log_file)) LearnRuns();  // it began since
  const auto run = runs_.find(log_file);
  const std::string& robot = run == runs_.end() ? options_.robot : run->second.robot;
  RequireRobot(robot, fmt::format("{}: {}", path_, log_file));
  return robot;
}

// So that a start does not send again what the ones before have sent. No row is added to a run that has ended.
bool DatabaseIngest::IsThere(const std::string& robot, const std::string& log_file) {
  const auto [known, is_new] = was_there_.try_emplace(log_file, false);
  if (is_new && runs_[log_file].end_utime) known->second = store_.Count(robot, log_file) == database_->Count(log_file);
  return known->second;
}

std::map<std::string, Rows> DatabaseIngest::ToSend(Rows rows) {
  std::map<std::string, Rows> by_robot;
  const auto divide = [&](auto& all, auto of_robot) {
    KeepOf(options_.shard, all);
    for (auto& row : all) {
      const std::string& robot = RobotOf(row.event.log_file);
      if (!IsThere(robot, row.event.log_file)) (by_robot[robot].*of_robot).push_back(std::move(row));
    }
  };
  divide(rows.decisions, &Rows::decisions);
  divide(rows.events, &Rows::events);
  divide(rows.gaps, &Rows::gaps);
  divide(rows.transitions, &Rows::transitions);
  return by_robot;
}

// A run that lasts has one state: what it has so far, its rows tell.
void DatabaseIngest::SendStates(const std::vector<RunRow>& runs, Ingested& sum) {
  for (const RunRow& run : runs) {
    const auto sent = sent_.find(run.log_file);
    if (sent != sent_.end() && sent->second.end_utime == run.end_utime &&
        sent->second.log_deleted_utime == run.log_deleted_utime)
      continue;
    store_.Write(RobotOf(run.log_file), {}, {run});
    if (sent == sent_.end()) ++sum.logs;
    sent_[run.log_file] = run;
  }
}

Ingested IngestLogs(const RunLogs& run, Store& store, const IngestOptions& options) {
  const BusOptions channels = ChannelsOf(run.logs, options.config, options.key);
  const std::optional<KeyRing> keys = PublicKeysOf(channels);
  const std::string robot = keys ? keys->robot() : options.robot;
  RequireRobot(robot, run.logs.front());
  Interpreter interpreter(channels, "", keys);
  Ingested sum;
  std::string before;
  for (const std::string& path : run.logs) {
    RunRow state;
    state.log_file = std::filesystem::path(path).filename().string();
    state.continues = before;
    Rows rows;
    const auto send = [&](const std::vector<RunRow>& states) {
      KeepOf(options.shard, rows.decisions);
      KeepOf(options.shard, rows.events);
      KeepOf(options.shard, rows.gaps);
      KeepOf(options.shard, rows.transitions);
      sum.added += store.Write(robot, rows, states);
      Count(std::exchange(rows, {}), sum);
    };
    interpreter.Continue(state.log_file);
    EventLogReader reader(path);
    ForEachEvent(reader, [&](const LogEvent& event) {
      if (state.events == 0) state.start_utime = event.utime;
      state.end_utime = event.utime;
      state.events = event.number + 1;
      interpreter.Observe(event, rows);
      if (rows.size() >= kRowsAtOnce) send({});
    });
    send({state});
    ++sum.logs;
    before = state.log_file;
  }
  return sum;
}

}  // namespace forereach
