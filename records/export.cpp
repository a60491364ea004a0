#include "records/export.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <utility>

#include <fmt/core.h>

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

// Where a shard's pieces go.
struct ShardFile {
  std::int64_t run;
  Shard shard;
  OutputFile file;
};

// A format. It counts what it writes. It makes a piece of each case, and puts it into its files, or a shard's.
class Sink : public RecordUser {
 public:
  explicit Sink(std::string name, ShardFile* shard) : robot(std::move(name)), shard_(shard) {}
  /** Writes a piece of ExportShard. @throws nlohmann::json::exception if it is none. */
  virtual void Put(const nlohmann::json& piece) = 0;
  virtual void Finish() = 0;

  const std::string robot;
  ExportResult result;
  std::int64_t cases = 0;

 protected:
  // The next case has come. Whether it is ours.
  [[nodiscard]] bool Next() { return shard_ ? cases++ % shard_->shard.count == shard_->shard.index : true; }
  [[nodiscard]] bool IsShard() const { return shard_ != nullptr; }
  void Keep(nlohmann::json what) {
    nlohmann::json piece{shard_->run, cases - 1};
    for (auto& each : what) piece.push_back(std::move(each));
    std::string bytes;
    nlohmann::json::to_cbor(piece, bytes);
    shard_->file.Write(bytes);
  }

 private:
  ShardFile* const shard_;  // null: all cases, in the format's files
};

OutputFile FileOf(const std::string& path) { return OutputFile(path, OutputFile::Existing::kReplaced); }

// ---- Tables.

class TableSink : public Sink {
 public:
  using Sink::Sink;

  void OnDecision(const DecisionRow& row, const candidate_plan_t* candidate) final {
    if (!Next()) return;
    ++result.decisions;
    result.without_candidate += candidate == nullptr;
    Write("decision", CellsOf(robot, row, candidate), candidate);
    if (candidate && HasCounts(*candidate)) OnControls(row, *candidate);
  }
  void OnWithdrawn(const withdrawal_t& withdrawal, const LogReference& event) final {
    if (!Next()) return;
    ++result.withdrawals;
    Write("withdrawal", CellsOf(robot, withdrawal, event), nullptr);
  }
  void OnExecution(const EventRow& row) final {
    if (!Next()) return;
    ++result.executions;
    Write("execution_event", CellsOf(robot, row), nullptr);
  }
  void OnGap(const GapRow& row) final {
    if (!Next()) return;
    ++result.gaps;
    Write("gap", CellsOf(robot, row), nullptr);
  }
  void Put(const nlohmann::json& piece) final {
    Append(piece.at(2).get_ref<const std::string&>(), piece.at(3).get_ref<const std::string&>());
  }

 protected:
  void Write(const std::string& record, const Cells& cells, const candidate_plan_t* candidate) {
    const std::string line = LineOf(record, cells, candidate);
    IsShard() ? Keep({record, line}) : Append(record, line);
  }

 private:
  virtual void OnControls(const DecisionRow&, const candidate_plan_t&) {}
  virtual std::string LineOf(const std::string& record, const Cells& cells, const candidate_plan_t* candidate) = 0;
  virtual void Append(const std::string& record, const std::string& line) = 0;
};

class JsonLinesSink final : public TableSink {
 public:
  JsonLinesSink(const std::string& name, ShardFile* shard, const std::vector<std::string>& files)
      : TableSink(name, shard) {
    if (!shard) file_.emplace(FileOf(files.at(0)));
  }
  void Finish() override { file_->Close(); }

 private:
  std::string LineOf(const std::string& record, const Cells& cells, const candidate_plan_t* candidate) override {
    return JsonLine(record, cells, candidate);
  }
  void Append(const std::string&, const std::string& line) override { file_->Write(line); }

  std::optional<OutputFile> file_;
};

class CsvSink final : public TableSink {
 public:
  CsvSink(const std::string& name, ShardFile* shard, const std::vector<std::string>& files) : TableSink(name, shard) {
    if (shard) return;
    static const candidate_plan_t none{};
    const Cells first[] = {CellsOf("", DecisionRow{}, nullptr), CellsOfControl("", DecisionRow{}, none, 0),
                           CellsOf("", EventRow{}), CellsOf("", withdrawal_t{}, LogReference{}), CellsOf("", GapRow{})};
    const char* const records[] = {"decision", "control", "execution_event", "withdrawal", "gap"};
    for (std::size_t i = 0; i < std::size(records); ++i)
      files_.emplace(records[i], FileOf(files.at(i))).first->second.Write(CsvHeader(first[i]));
  }
  void Finish() override {
    for (auto& [record, file] : files_) file.Close();
  }

 private:
  void OnControls(const DecisionRow& row, const candidate_plan_t& candidate) override {
    for (int t = 0; t < candidate.num_steps; ++t) Write("control", CellsOfControl(robot, row, candidate, t), nullptr);
  }
  std::string LineOf(const std::string&, const Cells& cells, const candidate_plan_t*) override {
    return CsvLine(cells);
  }
  void Append(const std::string& record, const std::string& line) override {
    if (const auto file = files_.find(record); file != files_.end()) file->second.Write(line);
  }

  std::map<std::string, OutputFile> files_;
};

// ---- Tubes.

class NpzSink final : public Sink {
 public:
  NpzSink(const std::string& of, ShardFile* shard, const std::vector<std::string>& files) : Sink(of, shard) {
    if (shard) return;
    arrays_.emplace(FileOf(files.at(0)));
    for (const char* name : {"plan_id", "utime", "start_utime", "step_us", "expires_utime", "event_number",
                             "num_states", "num_inputs", "num_steps"})
      arrays_->Declare(name, 'i');
    for (const char* name : {"robot", "source", "log_file", "plan_digest"}) arrays_->Declare(name, 'S');
    for (const char* name : {"slice_lower", "slice_upper", "controls", "initial_center", "initial_half_width"})
      arrays_->Declare(name, 'f');
    AddBegins();
  }

  // A piece is the message: its arrays are copies.
  void OnCertified(const certified_plan_t& certified, const LogReference& event) override {
    if (!Next()) return;
    if (!HasCounts(certified.plan))
      ++result.left_out;
    else if (IsShard())
      Keep({nlohmann::json::binary(Encode(certified)), event.log_file, event.event_number});
    else
      Add(certified, event.log_file, event.event_number);
  }
  void Put(const nlohmann::json& piece) override {
    const auto certified = Decoded<certified_plan_t>(piece.at(2).get_binary());
    if (certified && HasCounts(certified->plan)) Add(*certified, piece.at(3), piece.at(4));
  }
  void Finish() override { arrays_->Finish(); }

 private:
  void Add(const certified_plan_t& certified, const std::string& log_file, std::int64_t event_number) {
    const candidate_plan_t& plan = certified.plan;
    ++result.tubes;
    const auto n = static_cast<std::size_t>(plan.num_states), m = static_cast<std::size_t>(plan.num_inputs);
    for (int t = 0; t <= plan.num_steps; ++t) {
      arrays_->AddRow("slice_lower", std::span(certified.slice_lower[t], n));
      arrays_->AddRow("slice_upper", std::span(certified.slice_upper[t], n));
    }
    for (int t = 0; t < plan.num_steps; ++t) arrays_->AddRow("controls", std::span(plan.control[t], m));
    arrays_->AddRow("initial_center", std::span(plan.initial_center, n));
    arrays_->AddRow("initial_half_width", std::span(plan.initial_half_width, n));
    for (const auto& [name, value] : {std::pair{"plan_id", plan.plan_id},
                                      {"utime", certified.utime},
                                      {"start_utime", plan.start_utime},
                                      {"step_us", plan.step_us},
                                      {"expires_utime", certified.expires_utime},
                                      {"event_number", event_number}})
      arrays_->Add(name, value);
    arrays_->Add("num_states", std::int64_t{plan.num_states});
    arrays_->Add("num_inputs", std::int64_t{plan.num_inputs});
    arrays_->Add("num_steps", std::int64_t{plan.num_steps});
    arrays_->Add("robot", Printable(robot));
    arrays_->Add("source", GetText(plan.source));
    arrays_->Add("log_file", Printable(log_file));
    arrays_->Add("plan_digest", ToHex(GetDigest(certified.plan_digest)));
    slices_ += plan.num_steps + 1;
    controls_ += plan.num_steps;
    AddBegins();
  }
  // Where the next plan's rows begin: one entry more than there are plans.
  void AddBegins() {
    arrays_->Add("slice_begin", slices_);
    arrays_->Add("control_begin", controls_);
  }

  std::optional<NpzWriter> arrays_;
  std::int64_t slices_ = 0, controls_ = 0;
};

// ---- MCAP.

class McapSink final : public Sink {
 public:
  McapSink(const std::string& name, ShardFile* shard, bool names_robot, const std::vector<std::string>& files)
      : Sink(name, shard), prefix_(names_robot ? Printable(name) + "/" : "") {
    if (!shard) file_.emplace(FileOf(files.at(0)));
  }

  void OnMessage(const LogEvent& event) override {
    if (!Next()) return;
    const auto message = ToJsonMessage(event.message());
    if (!message) {
      ++result.left_out;
      return;
    }
    const std::int64_t published = message->utime > 0 ? message->utime : event.utime;
    if (IsShard())
      Keep({event.channel, message->type, message->sequence, event.utime, published, message->json});
    else
      Put(event.channel, message->type, message->sequence, event.utime, published, message->json);
  }
  void Put(const nlohmann::json& piece) override {
    Put(piece.at(2), piece.at(3).get<std::string>(), piece.at(4), piece.at(5), piece.at(6),
        piece.at(7).get<std::string>());
  }
  void Finish() override { file_->Finish(); }

 private:
  static constexpr std::size_t kChannels = 256;  // invented names must not fill the memory

  void Put(const std::string& name, std::string_view type, std::int64_t sequence, std::int64_t utime,
           std::int64_t published, std::string_view json) {
    const auto channel = ChannelOf(name, type);
    if (!channel) {
      ++result.left_out;
      return;
    }
    ++result.messages;
    file_->Write(*channel, static_cast<std::uint32_t>(sequence), utime, published, json);
  }
  // A channel of the log with messages of several types is as many channels of the file.
  std::optional<std::uint16_t> ChannelOf(const std::string& name, std::string_view of_type) {
    const std::string type(of_type);
    const auto found = channels_.find({name, type});
    if (found != channels_.end()) return found->second;
    if (channels_.size() == kChannels) return std::nullopt;
    auto schema = schemas_.find(type);
    if (schema == schemas_.end())
      schema = schemas_.emplace(type, file_->AddSchema("forereach." + type, SchemaOf(type))).first;
    std::string topic = prefix_ + Printable(name);
    if (!topics_.insert(topic).second) topics_.insert(topic += fmt::format(" ({})", type));
    return channels_
        .emplace(std::pair(name, type), file_->AddChannel(schema->second, topic, {{"robot", Printable(robot)}}))
        .first->second;
  }

  const std::string prefix_;  // of all channels
  std::optional<McapWriter> file_;
  std::map<std::string, std::uint16_t> schemas_;
  std::map<std::pair<std::string, std::string>, std::uint16_t> channels_;
  std::set<std::string> topics_;
};

// @param files in the order of ExportFiles; none for a shard.
std::unique_ptr<Sink> SinkOf(const std::string& robot, const ExportOptions& options,
                             const std::vector<std::string>& files, ShardFile* shard = nullptr) {
  switch (options.format) {
    case ExportFormat::kCsv: return std::make_unique<CsvSink>(robot, shard, files);
    case ExportFormat::kJsonLines: return std::make_unique<JsonLinesSink>(robot, shard, files);
    case ExportFormat::kNpz: return std::make_unique<NpzSink>(robot, shard, files);
    case ExportFormat::kMcap: return std::make_unique<McapSink>(robot, shard, options.names_robot, files);
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

namespace {

void ReadRun(const RunLogs& run, const ExportOptions& options, const std::function<void(std::int64_t)>& on_bytes,
             Sink& sink) {
  if (!run.missing.empty()) {
    Database database(run.database);
    for (const RunRow& missing : run.missing)
      database.ReadInBlocks(missing.log_file, [&](const Rows& rows) { TakeRows(rows, sink); });
  }
  if (!run.logs.empty()) ReadLogs(run.logs, options, on_bytes, sink);
}

}  // namespace

ExportResult ExportRun(const RunLogs& run, const ExportOptions& options, const std::vector<std::string>& files,
                       const std::function<void(std::int64_t)>& on_bytes) {
  const std::unique_ptr<Sink> sink = SinkOf(run.robot, options, files);
  ReadRun(run, options, on_bytes, *sink);
  sink->Finish();
  sink->result.files = files;
  return std::move(sink->result);
}

CaseResults<ExportResult> ExportShard(const RunLogs& run, std::int64_t number, const ExportOptions& options,
                                      const Shard& shard, const std::string& file,
                                      const std::function<void(std::int64_t)>& on_bytes) {
  ShardFile kept{number, shard, FileOf(file)};
  const std::unique_ptr<Sink> sink = SinkOf(run.robot, options, {}, &kept);
  ReadRun(run, options, on_bytes, *sink);
  kept.file.Close();
  CaseResults<ExportResult> results;
  results.cases = sink->cases;
  results.of_run.damage = std::exchange(sink->result.damage, {});
  results.of_run.passed_over = std::exchange(sink->result.passed_over, {});
  results.of_run.has_messages = std::exchange(sink->result.has_messages, false);
  results.counts = std::move(sink->result);
  return results;
}

ShardPieces::ShardPieces(const std::string& path) : path_(path), in_(path) {
  std::string header;
  std::getline(in_, header);
}

void ShardPieces::Refuse() const { throw OutputError(fmt::format("{}: has no pieces of an export", path_)); }

// The next piece, unless it is there: an array of at most 23 whole numbers, texts and byte strings, each in one part.
// All else may nest, and nlohmann's reader recurses.
void ShardPieces::Read() {
  if (!next_.is_null() || in_.peek() == '}') return;
  constexpr int kArray = 0x80, kMostEntries = 23, kArrayType = 4, kInParts = 31;
  const int head = in_.get();
  if (head < kArray || head > kArray + kMostEntries) Refuse();
  next_ = nlohmann::json::array();
  for (int i = kArray; i < head; ++i) {
    const int entry = in_.peek();
    if (entry < 0 || entry >> 5 >= kArrayType || (entry & kInParts) == kInParts) Refuse();
    next_.push_back(nlohmann::json::from_cbor(in_, false));
  }
}

nlohmann::json ShardPieces::Take(std::int64_t run, std::int64_t number) try {
  Read();
  if (next_.is_null() || next_.at(0) != run || next_.at(1) != number) return nullptr;
  return std::exchange(next_, nullptr);
} catch (const nlohmann::json::exception&) {
  Refuse();
}

std::int64_t ShardPieces::Next(std::int64_t run, std::int64_t first) try {
  Read();
  if (next_.is_null() || next_.at(0) != run) return INT64_MAX;
  const auto number = next_.at(1).get<std::int64_t>();
  if (number < first) Refuse();
  return number;
} catch (const nlohmann::json::exception&) {
  Refuse();
}

ExportResult ExportPieces(const std::string& robot, std::int64_t number, std::int64_t cases,
                          const ExportOptions& options, std::vector<ShardPieces>& shards,
                          const std::vector<std::string>& files) {
  const std::unique_ptr<Sink> sink = SinkOf(robot, options, files);
  for (std::int64_t i = 0; i < cases; ++i) {
    if (i % std::ssize(shards) == 0) {  // past cases without pieces
      std::int64_t next = cases;
      for (ShardPieces& shard : shards) next = std::min(next, shard.Next(number, i));
      if (next == cases) break;
      i = next - next % std::ssize(shards);
    }
    ShardPieces& shard = shards[static_cast<std::size_t>(i) % shards.size()];
    for (nlohmann::json piece; !(piece = shard.Take(number, i)).is_null();) sink->Put(piece);
  }
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
