#include "records/export.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <utility>

#include "lcmtypes/printable.h"
#include "records/database.h"
#include "records/export_table.h"
#include "records/log_survey.h"
#include "records/log_tasks.h"
#include "records/mcap.h"
#include "records/message_json.h"
#include "records/npz.h"
#include "records/output_file.h"
#include "records/record_reader.h"

namespace forereach {
namespace {

// A format. It counts what it writes.
class Sink : public RecordUser {
 public:
  explicit Sink(std::string name) : robot(std::move(name)) {}
  virtual void Finish() = 0;

  const std::string robot;
  ExportResult result;
};

OutputFile FileOf(const std::string& path) { return OutputFile(path, OutputFile::Existing::kReplaced); }

// ---- Tables.

class TableSink : public Sink {
 public:
  using Sink::Sink;

  void OnDecision(const DecisionRow& row, const candidate_plan_t* candidate) final {
    ++result.decisions;
    result.without_candidate += candidate == nullptr;
    Write("decision", CellsOf(robot, row, candidate), candidate);
    if (candidate && HasCounts(*candidate)) OnControls(row, *candidate);
  }
  void OnWithdrawn(const withdrawal_t& withdrawal, const LogReference& event) final {
    ++result.withdrawals;
    Write("withdrawal", CellsOf(robot, withdrawal, event), nullptr);
  }
  void OnExecution(const EventRow& row) final {
    ++result.executions;
    Write("execution_event", CellsOf(robot, row), nullptr);
  }
  void OnGap(const GapRow& row) final {
    ++result.gaps;
    Write("gap", CellsOf(robot, row), nullptr);
  }

 private:
  virtual void OnControls(const DecisionRow&, const candidate_plan_t&) {}
  virtual void Write(const char* record, const Cells& cells, const candidate_plan_t* candidate) = 0;
};

class JsonLinesSink final : public TableSink {
 public:
  JsonLinesSink(const std::string& name, const std::string& path) : TableSink(name), file_(FileOf(path)) {}
  void Finish() override { file_.Close(); }

 private:
  void Write(const char* record, const Cells& cells, const candidate_plan_t* candidate) override {
    file_.Write(JsonLine(record, cells, candidate));
  }

  OutputFile file_;
};

class CsvSink final : public TableSink {
 public:
  CsvSink(const std::string& name, const std::vector<std::string>& files) : TableSink(name) {
    static const candidate_plan_t none{};
    const Cells first[] = {CellsOf("", DecisionRow{}, nullptr), CellsOfControl("", DecisionRow{}, none, 0),
                           CellsOf("", EventRow{}), CellsOf("", withdrawal_t{}, LogReference{}), CellsOf("", GapRow{})};
    const char* const records[] = {"decision", "control", "execution_event", "withdrawal", "gap"};
    for (std::size_t i = 0; i < std::size(records); ++i)
      files_.emplace(records[i], FileOf(files[i])).first->second.Write(CsvHeader(first[i]));
  }
  void Finish() override {
    for (auto& [record, file] : files_) file.Close();
  }

 private:
  void OnControls(const DecisionRow& row, const candidate_plan_t& candidate) override {
    for (int t = 0; t < candidate.num_steps; ++t) Write("control", CellsOfControl(robot, row, candidate, t), nullptr);
  }
  void Write(const char* record, const Cells& cells, const candidate_plan_t*) override {
    files_.find(record)->second.Write(CsvLine(cells));
  }

  std::map<std::string_view, OutputFile> files_;
};

// ---- Tubes.

class NpzSink final : public Sink {
 public:
  NpzSink(const std::string& of, const std::string& path) : Sink(of), arrays_(FileOf(path)) {
    for (const char* name : {"plan_id", "utime", "start_utime", "step_us", "expires_utime", "event_number",
                             "num_states", "num_inputs", "num_steps"})
      arrays_.Declare(name, 'i');
    for (const char* name : {"robot", "source", "log_file", "plan_digest"}) arrays_.Declare(name, 'S');
    for (const char* name : {"slice_lower", "slice_upper", "controls", "initial_center", "initial_half_width"})
      arrays_.Declare(name, 'f');
    AddBegins();
  }

  void OnCertified(const certified_plan_t& certified, const LogReference& event) override {
    const candidate_plan_t& plan = certified.plan;
    if (!HasCounts(plan)) {
      ++result.left_out;
      return;
    }
    ++result.tubes;
    const auto n = static_cast<std::size_t>(plan.num_states), m = static_cast<std::size_t>(plan.num_inputs);
    for (int t = 0; t <= plan.num_steps; ++t) {
      arrays_.AddRow("slice_lower", std::span(certified.slice_lower[t], n));
      arrays_.AddRow("slice_upper", std::span(certified.slice_upper[t], n));
    }
    for (int t = 0; t < plan.num_steps; ++t) arrays_.AddRow("controls", std::span(plan.control[t], m));
    arrays_.AddRow("initial_center", std::span(plan.initial_center, n));
    arrays_.AddRow("initial_half_width", std::span(plan.initial_half_width, n));
    for (const auto& [name, value] : {std::pair{"plan_id", plan.plan_id},
                                      {"utime", certified.utime},
                                      {"start_utime", plan.start_utime},
                                      {"step_us", plan.step_us},
                                      {"expires_utime", certified.expires_utime},
                                      {"event_number", event.event_number}})
      arrays_.Add(name, value);
    arrays_.Add("num_states", std::int64_t{plan.num_states});
    arrays_.Add("num_inputs", std::int64_t{plan.num_inputs});
    arrays_.Add("num_steps", std::int64_t{plan.num_steps});
    arrays_.Add("robot", Printable(robot));
    arrays_.Add("source", GetText(plan.source));
    arrays_.Add("log_file", Printable(event.log_file));
    arrays_.Add("plan_digest", ToHex(GetDigest(certified.plan_digest)));
    slices_ += plan.num_steps + 1;
    controls_ += plan.num_steps;
    AddBegins();
  }
  void Finish() override { arrays_.Finish(); }

 private:
  // Where the next plan's rows begin: one entry more than there are plans.
  void AddBegins() {
    arrays_.Add("slice_begin", slices_);
    arrays_.Add("control_begin", controls_);
  }

  NpzWriter arrays_;
  std::int64_t slices_ = 0, controls_ = 0;
};

// ---- MCAP.

class McapSink final : public Sink {
 public:
  McapSink(const std::string& name, bool names_robot, const std::string& path)
      : Sink(name), prefix_(names_robot ? Printable(name) + "/" : ""), file_(FileOf(path)) {}

  void OnMessage(const LogEvent& event) override {
    const auto message = ToJsonMessage(event.message());
    const auto channel = message ? ChannelOf(event.channel, message->type) : std::nullopt;
    if (!channel) {
      ++result.left_out;
      return;
    }
    ++result.messages;
    file_.Write(*channel, static_cast<std::uint32_t>(message->sequence), event.utime,
                message->utime > 0 ? message->utime : event.utime, message->json);
  }
  void Finish() override { file_.Finish(); }

 private:
  static constexpr std::size_t kChannels = 256;  // invented names must not fill the memory

  // A channel of the log with messages of several types is as many channels of the file.
  std::optional<std::uint16_t> ChannelOf(const std::string& name, std::string_view type) {
    const auto found = channels_.find({name, type});
    if (found != channels_.end()) return found->second;
    if (channels_.size() == kChannels) return std::nullopt;
    auto schema = schemas_.find(type);
    if (schema == schemas_.end())
      schema = schemas_.emplace(type, file_.AddSchema("forereach." + std::string(type), SchemaOf(type))).first;
    std::string topic = prefix_ + Printable(name);
    if (!topics_.insert(topic).second) topics_.insert(topic += " (" + std::string(type) + ")");
    return channels_
        .emplace(std::pair(name, type), file_.AddChannel(schema->second, topic, {{"robot", Printable(robot)}}))
        .first->second;
  }

  const std::string prefix_;  // of all channels
  McapWriter file_;
  std::map<std::string_view, std::uint16_t> schemas_;
  std::map<std::pair<std::string, std::string_view>, std::uint16_t> channels_;
  std::set<std::string> topics_;
};

std::unique_ptr<Sink> SinkOf(const std::string& robot, const ExportOptions& options,
                             const std::vector<std::string>& files) {
  switch (options.format) {
    case ExportFormat::kCsv: return std::make_unique<CsvSink>(robot, files);
    case ExportFormat::kJsonLines: return std::make_unique<JsonLinesSink>(robot, files.at(0));
    case ExportFormat::kNpz: return std::make_unique<NpzSink>(robot, files.at(0));
    case ExportFormat::kMcap: return std::make_unique<McapSink>(robot, options.names_robot, files.at(0));
  }
  throw std::invalid_argument("no format of an export");
}

// All that is left of a log that is gone.
void TakeRows(const Rows& rows, Sink& sink) {
  sink.result.has_messages = true;
  for (const DecisionRow& row : rows.decisions) sink.OnDecision(row, nullptr);
  for (const EventRow& row : rows.events) sink.OnExecution(row);
  for (const GapRow& row : rows.gaps) sink.OnGap(row);
}

void ReadLogs(const std::vector<std::string>& logs, const ExportOptions& options,
              const std::function<void(std::int64_t)>& on_bytes, Sink& sink) {
  RequireLogs(logs);
  RecordReader reader(ChannelsOf(logs, options.config, options.key), sink, on_bytes);
  reader.Read(logs);
  sink.result.has_messages |= reader.has_messages();
  sink.result.damage = reader.damage();
  sink.result.passed_over = reader.passed_over();
}

}  // namespace

const std::vector<std::string>& ExportFiles(ExportFormat format) {
  static const std::vector<std::string> of[] = {
      {"decisions.csv", "controls.csv", "executions.csv", "withdrawals.csv", "gaps.csv"}, {"jsonl"}, {"npz"}, {"mcap"}};
  return of[static_cast<std::size_t>(format)];
}

ExportResult& ExportResult::operator+=(const ExportResult& other) {
  decisions += other.decisions;
  without_candidate += other.without_candidate;
  executions += other.executions;
  withdrawals += other.withdrawals;
  gaps += other.gaps;
  tubes += other.tubes;
  messages += other.messages;
  left_out += other.left_out;
  has_messages |= other.has_messages;
  damage += other.damage;
  passed_over += other.passed_over;
  return *this;
}

ExportResult ExportRun(const RunLogs& run, const ExportOptions& options, const std::vector<std::string>& files,
                       const std::function<void(std::int64_t)>& on_bytes) {
  const std::unique_ptr<Sink> sink = SinkOf(run.robot, options, files);
  if (!run.missing.empty()) {
    Database database(run.database);
    for (const RunRow& missing : run.missing)
      database.ReadInBlocks(missing.log_file, [&](const Rows& rows) { TakeRows(rows, *sink); });
  }
  if (!run.logs.empty()) ReadLogs(run.logs, options, on_bytes, *sink);
  sink->Finish();
  sink->result.files = files;
  return std::move(sink->result);
}

void JoinTables(ExportFormat format, const std::vector<std::string>& parts, const std::string& path) {
  OutputFile joined(path);
  bool is_first = true;
  for (const std::string& part : parts)
    joined.WriteContentOf(part, format == ExportFormat::kCsv && !std::exchange(is_first, false));
  joined.Close();
}

}  // namespace forereach
