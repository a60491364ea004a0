#include "logger/logger_node.h"

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <iterator>
#include <ostream>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace forereach {
namespace {

constexpr std::int64_t kMaxBufferBytes = 4 << 20;
constexpr std::size_t kMaxStreamsInOverflow = 256;
constexpr std::size_t kMaxWaitingRows = 100'000;  // while the database refuses them
constexpr int kEventsPerTransaction = 4096;

template <class Row>
void MoveTo(std::vector<Row>& to, std::vector<Row>& from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  from.clear();
}

std::string FreeName(const std::string& directory, std::int64_t now_us) {
  const std::string stem = fmt::format("events-{:%Y%m%d-%H%M%S}", fmt::gmtime(static_cast<std::time_t>(now_us / 1'000'000)));
  std::string name = stem + ".lcmlog";
  for (int i = 2; std::filesystem::exists(std::filesystem::path(directory) / name); ++i)
    name = fmt::format("{}-{}.lcmlog", stem, i);
  return name;
}

std::string MakeDirectory(const std::string& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) throw LogError("logger: cannot make the directory " + directory + ": " + error.message());
  return directory;
}

}  // namespace

LoggerNode::LoggerNode(const Config& config, Bus& bus, std::ostream& out)
    : bus_(bus),
      out_(out),
      channels_(config.bus),
      options_(config.logger),
      database_((std::filesystem::path(MakeDirectory(options_.directory)) / "decisions.sqlite").string()),
      summary_(config),
      bus_dropped_(bus.dropped()) {
  for (const RunRow& run : database_.Runs())
    if (!run.end_utime) Recover(run);
  bus.SubscribeUnchecked(".*", [this](const Received& received) { Receive(received); });
}

void LoggerNode::Recover(const RunRow& run) {
  const std::string path = (std::filesystem::path(options_.directory) / run.log_file).string();
  std::string text = "no log file was written";
  std::int64_t end_utime = run.start_utime;
  if (std::filesystem::exists(path)) try {
      const EventLogWriter mended(path);  // removes a cut tail, and keeps others from doing the same meanwhile
      EventLogReader reader(path);
      Interpreter interpreter(channels_, run.log_file);
      Rows rows;
      std::int64_t new_rows = 0, unwritten = 0, events = run.events;
      const auto write = [&] {
        const auto written = database_.Write(rows, run.log_file, events);
        if (!written) throw DatabaseError(database_.problem());
        new_rows += *written;
        unwritten = 0;
        rows = {};
      };
      ForEachEvent(reader, [&](const LogEvent& event) {
        interpreter.Observe(event, rows);
        if (event.number < run.events) rows = {};
        events = std::max(run.events, event.number + 1);
        if (++unwritten >= kEventsPerTransaction) write();
      });
      if (unwritten > 0) write();
      const LogRecovery& found = mended.recovery();
      text = fmt::format("{} events kept, a cut tail of {} bytes removed, {} damaged places of {} bytes left, {} rows written",
                         found.events, found.cut_bytes, found.corruptions, found.skipped_bytes, new_rows);
      end_utime = std::max(end_utime, found.last_utime);
    } catch (const LogError& error) {
      spdlog::warn("{} was not ended and is left alone: {}", run.log_file, error.what());
      return;
    }
  database_.EndRun(run.log_file, end_utime, text);
  recovered_.push_back(run.log_file + ": " + text);
  spdlog::warn("recovered {}", recovered_.back());
}

void LoggerNode::Receive(const Received& received) {
  if (queue_.size() < static_cast<std::size_t>(std::max(options_.queue, 1))) {
    queue_.push_back({received.utime, received.channel, {received.bytes.begin(), received.bytes.end()}});
    return;
  }
  Stream stream{received.channel, ""};
  if (interpreter_) stream = interpreter_->Identify(received.channel, WithoutSignature(received.bytes)).first;
  if (overflow_.size() >= kMaxStreamsInOverflow && !overflow_.contains(stream)) stream = {"*", ""};
  ++overflow_[stream];
}

void LoggerNode::Open(std::int64_t now_us) {
  log_file_ = FreeName(options_.directory, now_us);
  log_path_ = (std::filesystem::path(options_.directory) / log_file_).string();
  database_.BeginRun(log_file_, now_us);  // first: a log file that no run knows would not be mended
  log_.emplace(log_path_);
  interpreter_.emplace(channels_, log_file_);
  next_flush_us_ = now_us + static_cast<std::int64_t>(options_.flush_ms * 1000);
  spdlog::info("recording to {}", log_path_);
}

void LoggerNode::Tick(std::int64_t now_us) {
  now_us_ = now_us;
  if (!log_) Open(now_us);
  Drain(now_us);
  if (now_us >= next_flush_us_ || log_->pending_bytes() > kMaxBufferBytes) Flush(now_us);
}

void LoggerNode::Drain(std::int64_t now_us) {
  for (; !queue_.empty(); queue_.pop_front()) Record(std::move(queue_.front()));
  for (const auto& [stream, lost] : std::exchange(overflow_, {})) {
    AddGap(stream, lost, now_us, "queue");
    interpreter_->Forgive(stream, lost);
  }
  const std::int64_t dropped = bus_.dropped();
  if (dropped != bus_dropped_) AddGap({"*", ""}, dropped - bus_dropped_, now_us, "backlog");
  bus_dropped_ = dropped;
}

void LoggerNode::Record(Stored stored) {
  if (stored.bytes.size() > kMaxLogDataBytes || stored.channel.size() > kMaxLogChannelBytes || stored.channel.empty())
    return AddGap({stored.channel, ""}, 1, stored.utime, "disk");
  LogEvent event{log_->Append(stored.utime, stored.channel, stored.bytes), stored.utime, std::move(stored.channel),
                 std::move(stored.bytes)};
  ++unflushed_[event.channel];
  interpreter_->Observe(event, rows_);
  summary_.Add(event);
}

void LoggerNode::AddGap(const Stream& stream, std::int64_t lost, std::int64_t utime, const std::string& reason) {
  GapRow& gap = rows_.gaps.emplace_back();
  gap.event.log_file = log_file_;
  gap.channel = stream.channel;
  gap.source = stream.source;
  gap.lost = lost;
  gap.utime = utime;
  gap.reason = reason;
}

void LoggerNode::Flush(std::int64_t now_us) {
  next_flush_us_ = now_us + static_cast<std::int64_t>(options_.flush_ms * 1000);
  const bool flushed = log_->Flush();
  if (!flushed) {
    // The log does not have these events, so no row may refer to them.
    rows_.decisions.clear();
    rows_.events.clear();
    for (GapRow& gap : rows_.gaps) gap.event.event_number = -1;
    for (const auto& [channel, lost] : unflushed_) AddGap({channel, ""}, lost, now_us, "disk");
  }
  unflushed_.clear();
  summary_.Add(rows_);
  MoveTo(flushed_rows_.decisions, rows_.decisions);
  MoveTo(flushed_rows_.events, rows_.events);
  MoveTo(flushed_rows_.gaps, rows_.gaps);
  WriteRows();
  const bool failed = !flushed || !flushed_rows_.empty();
  Report(failed, !flushed ? log_->problem() : database_.problem());
}

// Rows that the database refuses wait for the next flush; beyond a bound they are left to the next start's recovery.
void LoggerNode::WriteRows() {
  const std::size_t waiting = flushed_rows_.decisions.size() + flushed_rows_.events.size() + flushed_rows_.gaps.size();
  if (waiting == 0) return;
  const std::int64_t events = rows_lost_ ? 0 : log_->next_number();
  if (database_.Write(flushed_rows_, log_file_, events)) {
    flushed_rows_ = {};
  } else if (waiting > kMaxWaitingRows) {
    rows_lost_ = true;
    flushed_rows_ = {};
  }
}

void LoggerNode::Report(bool failed, const std::string& problem) {
  if (failed && !failing_) spdlog::error("{}; recording goes on, what is lost is counted", problem);
  if (!failed && failing_) spdlog::info("{} can be written again", options_.directory);
  failing_ = failed;
}

void LoggerNode::Stop() {
  if (!log_) return;
  Drain(now_us_);
  Flush(now_us_);
  // A run with rows missing stays open, so that the next start makes them again from the log.
  if (flushed_rows_.empty() && !rows_lost_) database_.EndRun(log_file_, now_us_);
  out_ << "log                       " << log_path_ << "\ndatabase                  " << database_.path() << "\n"
       << ToText(summary_.Finish()) << std::flush;
}

}  // namespace forereach
