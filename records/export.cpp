#include "records/export.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <system_error>
#include <utility>

#include "certifier/task/config_error.h"
#include "lcmtypes/printable.h"
#include "records/export_table.h"
#include "records/log_survey.h"
#include "records/mcap.h"
#include "records/message_json.h"
#include "records/npz.h"
#include "records/output_file.h"
#include "records/record_reader.h"
#include "records/run_logs.h"

namespace forereach {
namespace {

namespace fs = std::filesystem;

// A format. It counts what it writes.
class Sink : public RecordUser {
 public:
  virtual void Finish() = 0;
  ExportResult result;
};

// ---- Tables.

class JsonLinesSink final : public Sink {
 public:
  explicit JsonLinesSink(const std::string& path) : file_(path) {}

  void OnDecision(const DecisionRow& row, const candidate_plan_t* candidate) override {
    ++result.decisions;
    result.without_candidate += candidate == nullptr;
    file_.Write(JsonLine("decision", CellsOf(row, candidate), candidate));
  }
  void OnWithdrawn(const withdrawal_t& withdrawal, const LogReference& event) override {
    ++result.withdrawals;
    file_.Write(JsonLine("withdrawal", CellsOf(withdrawal, event)));
  }
  void OnExecution(const EventRow& row) override {
    ++result.executions;
    file_.Write(JsonLine("execution_event", CellsOf(row)));
  }
  void OnGap(const GapRow& row) override {
    ++result.gaps;
    file_.Write(JsonLine("gap", CellsOf(row)));
  }
  void Finish() override { file_.Close(); }

 private:
  OutputFile file_;
};

class CsvSink final : public Sink {
 public:
  explicit CsvSink(const std::string& directory) : directory_(Made(directory)) {
    static const candidate_plan_t none{};
    decisions_.Write(CsvHeader(CellsOf(DecisionRow{}, nullptr)));
    controls_.Write(CsvHeader(CellsOfControl(DecisionRow{}, none, 0)));
    executions_.Write(CsvHeader(CellsOf(EventRow{})));
    withdrawals_.Write(CsvHeader(CellsOf(withdrawal_t{}, LogReference{})));
    gaps_.Write(CsvHeader(CellsOf(GapRow{})));
  }

  void OnDecision(const DecisionRow& row, const candidate_plan_t* candidate) override {
    ++result.decisions;
    result.without_candidate += candidate == nullptr;
    decisions_.Write(CsvLine(CellsOf(row, candidate)));
    if (!candidate || !HasCounts(*candidate)) return;
    for (int t = 0; t < candidate->num_steps; ++t) controls_.Write(CsvLine(CellsOfControl(row, *candidate, t)));
  }
  void OnWithdrawn(const withdrawal_t& withdrawal, const LogReference& event) override {
    ++result.withdrawals;
    withdrawals_.Write(CsvLine(CellsOf(withdrawal, event)));
  }
  void OnExecution(const EventRow& row) override {
    ++result.executions;
    executions_.Write(CsvLine(CellsOf(row)));
  }
  void OnGap(const GapRow& row) override {
    ++result.gaps;
    gaps_.Write(CsvLine(CellsOf(row)));
  }
  void Finish() override {
    for (OutputFile* file : {&decisions_, &controls_, &executions_, &withdrawals_, &gaps_}) file->Close();
  }

 private:
  static fs::path Made(const std::string& directory) {
    std::error_code error;
    fs::create_directories(directory, error);
    if (error || !fs::is_directory(directory, error))
      throw OutputError(directory + ": cannot be made a directory: " + error.message());
    return directory;
  }
  [[nodiscard]] OutputFile File(const char* name) const { return OutputFile((directory_ / name).string()); }

  const fs::path directory_;
  OutputFile decisions_ = File("decisions.csv"), controls_ = File("controls.csv"), executions_ = File("executions.csv"),
             withdrawals_ = File("withdrawals.csv"), gaps_ = File("gaps.csv");
};

// ---- Tubes.

class NpzSink final : public Sink {
 public:
  explicit NpzSink(const std::string& path) : arrays_(path) {
    for (const char* name : {"plan_id", "utime", "start_utime", "step_us", "expires_utime", "event_number",
                             "num_states", "num_inputs", "num_steps"})
      arrays_.Declare(name, 'i');
    for (const char* name : {"source", "log_file", "plan_digest"}) arrays_.Declare(name, 'S');
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
  explicit McapSink(const std::string& path) : file_(path) {}

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
    std::string topic = Printable(name);
    if (!topics_.insert(topic).second) topics_.insert(topic += " (" + std::string(type) + ")");
    return channels_.emplace(std::pair(name, type), file_.AddChannel(schema->second, topic)).first->second;
  }

  McapWriter file_;
  std::map<std::string_view, std::uint16_t> schemas_;
  std::map<std::pair<std::string, std::string_view>, std::uint16_t> channels_;
  std::set<std::string> topics_;
};

std::unique_ptr<Sink> SinkOf(const ExportOptions& options) {
  if (options.format == "csv") return std::make_unique<CsvSink>(options.output);
  if (options.format == "jsonl") return std::make_unique<JsonLinesSink>(options.output);
  if (options.format == "npz") return std::make_unique<NpzSink>(options.output);
  if (options.format == "mcap") return std::make_unique<McapSink>(options.output);
  throw ConfigError("no format: " + options.format);
}

// ---- The runs.

class Exporter final {
 public:
  Exporter(const ExportOptions& options, Sink& sink, std::function<void(std::int64_t)> on_bytes)
      : options_(options), sink_(sink), on_bytes_(std::move(on_bytes)) {}

  void ReadLogs(const std::vector<std::string>& logs, LogOrder order) {
    const LogSurvey survey = Survey(logs, order);
    const std::string directory = fs::path(logs.front()).parent_path().string();
    RecordReader reader(ChannelsOf(survey, directory, options_.config, options_.key), sink_, on_bytes_);
    reader.Read(logs);
    sink_.result.damage += reader.damage();
    const PassedOver passed_over = reader.passed_over();
    sink_.result.passed_over.not_authentic += passed_over.not_authentic;
    sink_.result.passed_over.undecodable += passed_over.undecodable;
  }

  void ReadDatabase(const std::string& path) {
    Database database(path);
    for (const RunLogs& run : RunsOf(database)) {
      for (const RunRow& missing : run.missing) {
        sink_.result.missing.push_back(missing.log_file + ": " + WhyMissing(missing));
        TakeRows(database.Read(missing.log_file));
      }
      if (!run.logs.empty()) ReadLogs(run.logs, LogOrder::kAny);
    }
  }

 private:
  // All that is left of a log that is gone.
  void TakeRows(const Rows& rows) {
    for (const DecisionRow& row : rows.decisions) sink_.OnDecision(row, nullptr);
    for (const EventRow& row : rows.events) sink_.OnExecution(row);
    for (const GapRow& row : rows.gaps) sink_.OnGap(row);
  }

  const ExportOptions& options_;
  Sink& sink_;
  const std::function<void(std::int64_t)> on_bytes_;
};

}  // namespace

ExportResult Export(const ExportOptions& options, std::function<void(std::int64_t)> on_bytes) {
  const std::optional<std::string> database = DatabaseAmong(options.inputs);
  const std::unique_ptr<Sink> sink = SinkOf(options);
  Exporter exporter(options, *sink, std::move(on_bytes));
  if (database)
    exporter.ReadDatabase(*database);
  else
    exporter.ReadLogs(options.inputs, LogOrder::kOneRun);
  sink->Finish();
  return std::move(sink->result);
}

}  // namespace forereach
