#include "logger/recorder.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <set>

#include <fmt/core.h>

#include "bus/bus_options.h"
#include "bus/log.h"
#include "forereach/certifier_status_t.hpp"
#include "lcmtypes/names.h"

namespace forereach {
namespace {

constexpr std::int64_t kMaxBufferBytes = 4 << 20;
constexpr std::size_t kMaxLosses = 256, kMaxChannels = 256;  // invented channels must not fill the memory
constexpr std::size_t kMaxTasks = 16, kMaxTasksInUse = 256;
constexpr int kEventsPerTransaction = 4096;
constexpr double kScanUs = 1e6, kGapsUs = 10e6, kRetryUs = 1e6;

// Subtracts from a gap that is found again the losses that gaps without an event already contain. False if none are
// left.
bool IsMore(GapRow& gap, std::map<std::string, std::int64_t>& counted) {
  const auto known = counted.find(gap.channel);
  if (known == counted.end()) return true;
  const std::int64_t again = std::min(known->second, gap.lost);
  known->second -= again;
  gap.lost -= again;
  return gap.lost > 0 || gap.reason == "restart";
}

void Count(std::map<std::string, std::int64_t>& counts, const std::string& channel, std::int64_t events) {
  counts[counts.size() < kMaxChannels || counts.contains(channel) ? channel : "*"] += events;
}

const char* DescribePlace(FilePlace place) {
  switch (place) {
    case FilePlace::kDeleted: return "was deleted or replaced";
    case FilePlace::kElsewhere: return "was moved";
    case FilePlace::kCut: return "was cut short";
    default: return "is not to be seen";
  }
}

// The rows of events that are in no log: gaps alone, without their event.
Rows WithoutEvents(Rows rows) {
  for (GapRow& gap : rows.gaps) {
    gap.event.event_number = -1;
    gap.event.digest.clear();
    gap.event.utime = gap.utime;
  }
  return {{}, {}, std::move(rows.gaps), {}};
}

// The entry of the map for losses of this reason and stream. Once the map is full, all new streams share one entry.
template <class Counts>
std::pair<std::string, Stream> KeyIn(const Counts& counts, const std::string& reason, const Stream& stream) {
  std::pair key{reason, stream};
  // Names of channels are whatever is sent, so they must not fill the memory.
  if (counts.size() >= kMaxLosses && !counts.contains(key)) key.second = {"*", ""};
  return key;
}

// The gaps without an event, merged by stream and reason.
std::vector<GapRow> MergedWithoutEvents(const std::vector<GapRow>& gaps) {
  std::map<std::pair<std::string, Stream>, GapRow> merged;
  for (const GapRow& gap : gaps) {
    if (gap.event.event_number >= 0) continue;
    const auto key = KeyIn(merged, gap.reason, {gap.channel, gap.source});
    const auto [entry, is_first] = merged.try_emplace(key, gap);
    GapRow& all = entry->second;
    all.channel = key.second.channel;
    all.source = key.second.source;
    if (is_first) continue;
    all.lost = SumOfLost(all.lost, gap.lost);
    all.utime = all.event.utime = std::min(all.utime, gap.utime);
    all.expected = all.got = -1;
  }
  std::vector<GapRow> rows;
  for (auto& [key, gap] : merged) rows.push_back(std::move(gap));
  return rows;
}

std::int64_t BytesOf(double megabytes) { return static_cast<std::int64_t>(megabytes * 1e6); }

}  // namespace

Recorder::Recorder(const Config& config, FreeSpace free_space)
    : channels_(config.bus),
      options_(config.logger),
      keys_(PublicKeysOf(channels_)),
      free_space_(std::move(free_space)),
      directory_(options_.directory),
      database_path_(directory_.PathOf(LogDirectory::kDatabase)),
      database_(std::make_unique<Database>(database_path_)),
      summary_(config),
      interpreter_(channels_, "", keys_),
      task_path_(config.path),
      kept_tasks_(options_.directory),
      task_reading_(kRetryUs),
      flush_(options_.flush_ms * 1e3),
      age_(options_.rotate_minutes * 60e6),
      scan_(kScanUs),
      gaps_(kGapsUs),
      retry_(kRetryUs),
      anew_(kRetryUs),
      database_anew_(kRetryUs) {
  if (!task_path_.empty()) AddTask(config);
  AdoptLogs();
  for (const RunRow& run : database_->Runs())
    if (!run.end_utime) Recover(run);
}

// The files are listed before the runs are read, so another logger's file has its run by then, or is locked. A logger
// that is killed between creating a file and recording its run leaves a file without events.
void Recorder::AdoptLogs() {
  const std::vector<std::string> logs = directory_.Logs();
  const std::vector<RunRow> runs = database_->Runs();
  for (const std::string& log : logs) {
    if (std::ranges::find(runs, log, &RunRow::log_file) != runs.end()) continue;
    try {
      const EventLogWriter locked(directory_.PathOf(log));
      const LogRecovery& found = locked.recovery();
      if (found.events == 0 && found.cut_bytes == 0 && found.damage.places == 0)
        directory_.Remove(log);
      else
        database_->BeginRun(log, found.first_utime, "", robot());
    } catch (const BadInput& error) {
      logging::Warn("no run knows {}, and it is left alone: {}", log, error.what());
    }
  }
}

void Recorder::Recover(const RunRow& run) {
  std::string text = "no log file was written";
  std::int64_t end_utime = run.start_utime;
  if (directory_.Bytes(run.log_file)) try {
      text = Mend(run, end_utime);
    } catch (const LogError& error) {
      logging::Warn("{} was not ended and is left alone: {}", run.log_file, error.what());
      return;
    }
  database_->EndRun(run.log_file, end_utime, text);
  recovered_.push_back(fmt::format("{}: {}", run.log_file, text));
  logging::Warn("recovered {}", recovered_.back());
}

std::string Recorder::Mend(const RunRow& run, std::int64_t& end_utime) {
  const std::string path = directory_.PathOf(run.log_file);
  const EventLogWriter mended(path);  // removes a cut tail, and locks the file against other loggers
  EventLogReader reader(path);
  Interpreter interpreter = InterpreterFor(run);
  const std::set<std::int64_t> known = database_->EventsBehindGaps(run.log_file);
  std::map<std::string, std::int64_t> counted = database_->LossesWithoutEvents(run.log_file);
  Rows rows;
  std::int64_t new_rows = 0, unwritten = 0, events = run.events;
  const auto write = [&] {
    const auto written = database_->Write(rows, run.log_file, events);
    if (!written) throw DatabaseError(database_->problem());
    new_rows += *written;
    unwritten = 0;
    rows = {};
  };
  ForEachEvent(reader, [&](const LogEvent& event) {
    const std::size_t gaps = rows.gaps.size();
    interpreter.Observe(event, rows);
    const bool is_found_again = rows.gaps.size() > gaps && !known.contains(event.number);
    if (is_found_again && !IsMore(rows.gaps.back(), counted)) rows.gaps.pop_back();
    // The database has its rows; it is read for the interpreter's state alone.
    if (event.number < run.events) rows = {};
    events = std::max(run.events, event.number + 1);
    if (++unwritten >= kEventsPerTransaction) write();
  });
  if (unwritten > 0) write();
  const LogRecovery& found = mended.recovery();
  end_utime = std::max(end_utime, found.last_utime);
  return fmt::format(
      "{} events kept, a cut tail of {} bytes removed, {} damaged places of {} bytes left, {} rows written",
      found.events, found.cut_bytes, found.damage.places, found.damage.bytes, new_rows);
}

// The interpreter's state at the beginning of the file: it has read the file before it, if there is one.
Interpreter Recorder::InterpreterFor(const RunRow& run) const {
  Interpreter interpreter(channels_, run.continues, keys_);
  if (!run.continues.empty() && directory_.Bytes(run.continues)) {
    EventLogReader before(directory_.PathOf(run.continues));
    Rows ignored;
    ForEachEvent(before, [&](const LogEvent& event) {
      interpreter.Observe(event, ignored);
      ignored = {};
    });
  }
  interpreter.Continue(run.log_file);
  return interpreter;
}

void Recorder::Begin(std::int64_t now_us) {
  Open(now_us, "");
  flush_.Start(now_us);
  WatchDisk(now_us);
  Report();
}

Database& Recorder::database() {
  if (!database_) throw DatabaseError(database_problem_);
  return *database_;
}

void Recorder::Open(std::int64_t now_us, const std::string& continues) {
  const std::vector<RunRow> runs = database().Runs();
  name_us_ = std::max(now_us, name_us_);  // the clock may have been set back, and names are read in their order
  const std::string file = directory_.FreeName(name_us_, [&](const std::string& name) {
    return std::ranges::find(runs, name, &RunRow::log_file) != runs.end();
  });
  auto log = std::make_unique<EventLogWriter>(directory_.PathOf(file));
  try {
    database().BeginRun(file, now_us, continues, robot());
  } catch (const DatabaseError&) {
    directory_.Remove(file);  // it is empty and belongs to no run
    throw;
  }
  // What the file that is gone has not taken is not lost.
  if (log_ && log_->pending_bytes() > 0) log->TakeOver(*log_);
  log_ = std::move(log);
  log_file_ = file;
  log_path_ = directory_.PathOf(file);
  interpreter_.Continue(file);
  other_bytes_ = directory_.LogBytes(file);
  continues_ = continues;
  begun_us_ = now_us;
  confirmed_.clear();
  told_events_ = 0;
  rows_lost_ = needs_new_file_ = false;
  ++files_;
  age_.Start(now_us);
  logging::Info("recording to {}", log_path_);
  KeepTasks();
}

void Recorder::AddTask(const Config& config) {
  try {
    const bool is_known = std::ranges::any_of(tasks_, [&](const TaskCopy& task) {
      return task.digest == config.grounds.config && task.observations_digest == config.grounds.observations;
    });
    if (is_known) return;
    if (tasks_.size() >= kMaxTasks) tasks_.erase(tasks_.begin());
    tasks_.push_back(CopyTask(config));
    tasks_in_use_.insert(ToHex(config.grounds.config));
  } catch (const BadInput& error) {
    logging::Error("the task is not kept next to the log: {}", error.what());
  }
}

void Recorder::KeepTasks() const {
  for (const TaskCopy& task : tasks_) try {
      kept_tasks_.Keep(task);
    } catch (const BadInput& error) {
      logging::Error("the task {} is not kept next to the log: {}", ToHex(task.digest), error.what());
    }
}

// A reload may change the transitions without the task file; then only the version changes.
void Recorder::NoticeTask(const LogEvent& event, std::int64_t now_us) {
  if (task_path_.empty() || event.channel != channels_.status) return;
  const auto heartbeat = Decoded<certifier_status_t>(event.message());
  if (!heartbeat || !IsInCharge(*heartbeat)) return;
  const std::pair heard{GetDigest(heartbeat->config_digest), heartbeat->version};
  if (heard == heard_task_) return;
  const bool is_first = !heard_task_ && !tasks_.empty() && tasks_.back().digest == heard.first;
  if (!is_first && !task_reading_.IsOver(now_us)) return;
  heard_task_ = heard;
  if (tasks_in_use_.size() < kMaxTasksInUse) tasks_in_use_.insert(ToHex(heard.first));
  if (is_first) return;
  task_reading_.Start(now_us);
  try {
    const Config config = LoadConfig(task_path_);
    if (config.grounds.config != heard.first)
      throw ConfigError("{} is another, of config digest {}", task_path_, ToHex(config.grounds.config));
    AddTask(config);
    KeepTasks();
  } catch (const BadInput& error) {
    logging::Warn("the certifier's task, config digest {}, is not kept next to the log: {}", ToHex(heard.first),
                  error.what());
  }
}

// Removes the tasks that no log names any more. A run that was not ended may lack rows, so its tasks are kept.
void Recorder::ForgetTasksOf(const std::string& log) {
  std::set<std::string> forgotten = database().ConfigDigests(log);
  for (const RunRow& run : database().Runs()) {
    if (!directory_.Bytes(run.log_file)) continue;
    if (!run.end_utime && run.log_file != log_file_) return;
    for (const std::string& digest : database().ConfigDigests(run.log_file)) forgotten.erase(digest);
  }
  for (const std::string& digest : forgotten)
    if (!tasks_in_use_.contains(digest)) kept_tasks_.Remove(digest);
}

void Recorder::Rotate(std::int64_t now_us) {
  if (!retry_.IsOver(now_us)) return;
  const std::string before = log_file_;
  const bool flushed = Flush(now_us);
  if (is_log_lost_ || log_file_ != before) return;  // the file had disappeared
  const std::string ended = log_file_;
  const bool whole = !rows_lost_;
  std::int64_t events = 0;
  for (const auto& [channel, confirmed] : confirmed_) events += confirmed;
  try {
    if (!flushed || !flushed_rows_.empty()) throw LogError("the events and rows of this one cannot be written");
    Open(now_us, ended);
    earlier_files_[ended] = events;
    if (whole) database().EndRun(ended, now_us);
    WatchDisk(now_us);  // the ended file may now be deleted for the quota
    rotation_problem_.clear();
  } catch (const BadInput& error) {
    rotation_problem_ = fmt::format("no new log file: {}", error.what());
    retry_.Start(now_us);
  }
}

void Recorder::Tick(std::int64_t now_us) {
  // If the quota has no room, even this file may have to be deleted, and only an ended file may be.
  if ((age_.IsOver(now_us) || pause_ == "quota" || needs_new_file_) && log_->next_number() > 0) Rotate(now_us);
  if (flush_.IsOver(now_us) || log_->pending_bytes() > kMaxBufferBytes) Flush(now_us);
}

void Recorder::Take(LogEvent event, std::int64_t now_us) {
  NoticeTask(event, now_us);
  if (event.data.size() > kMaxLogDataBytes || event.channel.size() > kMaxLogChannelBytes || event.channel.empty())
    return CountLoss({event.channel, ""}, 1, event.utime, "disk");
  const std::int64_t bytes = RecordBytes(event);
  if (file_bytes() + bytes > BytesOf(options_.rotate_mb) && log_->next_number() > 0) Rotate(now_us);
  if (pause_.empty() && !MakeRoom(bytes, now_us)) pause_ = "quota";
  if (!pause_.empty()) return Miss(std::move(event));
  event.utime = std::max<std::int64_t>(event.utime, 0);
  event.number = log_->Append(event.utime, event.channel, event.data);
  Count(unflushed_, event.channel, 1);
  interpreter_.Observe(event, rows_);
  summary_.Add(event);
}

// The counts continue, so that losses by the pause are not counted as losses of the bus.
void Recorder::Miss(LogEvent event) {
  Rows missed;
  interpreter_.Observe(event, missed);
  std::ranges::move(WithoutEvents(std::move(missed)).gaps, std::back_inserter(rows_.gaps));
  CountLoss({event.channel, ""}, 1, event.utime, pause_);
}

void Recorder::Lose(const Stream& stream, std::int64_t lost, std::int64_t utime, const std::string& reason) {
  CountLoss(stream, lost, utime, reason);
  interpreter_.Forgive(stream, lost);
}

void Recorder::CountLoss(const Stream& stream, std::int64_t lost, std::int64_t utime, const std::string& reason) {
  Loss& loss = losses_.try_emplace(KeyIn(losses_, reason, stream), Loss{0, utime}).first->second;
  loss.lost += lost;
  lost_ += lost;
}

void Recorder::MakeGaps(std::int64_t now_us) {
  for (const auto& [key, loss] : losses_) {
    const auto& [reason, stream] = key;
    rows_.gaps.push_back({{log_file_, -1, "", loss.first_utime},
                          stream.channel,
                          stream.source,
                          -1,
                          -1,
                          loss.lost,
                          loss.first_utime,
                          reason});
  }
  losses_.clear();
  gaps_.Start(now_us);
}

// After a file was deleted or moved, its descriptor still works, so only the path shows the change.
void Recorder::WatchFiles(std::int64_t now_us) {
  WatchDatabase(now_us);
  if (!is_log_lost_) {
    const FilePlace place = log_->Look();
    is_log_hidden_ = place == FilePlace::kUnknown;
    if (place == FilePlace::kThere || place == FilePlace::kUnknown) return;
    GiveUpLog(place, now_us);
  }
  if (anew_.IsOver(now_us)) StartAnew(now_us);
}

void Recorder::GiveUpLog(FilePlace place, std::int64_t now_us) {
  is_log_lost_ = true;
  Counts left;
  if (place == FilePlace::kCut) try {
      EventLogReader reader(log_path_);
      ForEachEvent(reader,
                   [&](const LogEvent& event) { ++left[confirmed_.contains(event.channel) ? event.channel : "*"]; });
    } catch (const LogError& error) {
      logging::Error("{}: its remaining part cannot be read: {}", log_file_, error.what());
    }
  std::int64_t events = CountEarlierFilesGone(now_us);
  for (const auto& [channel, confirmed] : std::exchange(confirmed_, {})) {
    const std::int64_t lost = std::max<std::int64_t>(confirmed - left[channel], 0);
    if (lost > 0) CountLoss({channel, ""}, lost, now_us, "gone");
    events += lost;
  }
  if (events > 0) gone_ = fmt::format("{} {}, {} confirmed events are gone", log_file_, DescribePlace(place), events);
  logging::Error("{} {} while it was written: {} confirmed events are gone", log_path_, DescribePlace(place), events);
}

// Files that were deleted for the quota do not count.
std::int64_t Recorder::CountEarlierFilesGone(std::int64_t now_us) {
  std::int64_t gone = 0;
  std::erase_if(earlier_files_, [&](const auto& entry) {
    const auto& [file, events] = entry;
    if (directory_.Bytes(file)) return false;
    CountLoss({"*", ""}, events, now_us, "gone");
    gone += events;
    return true;
  });
  if (gone > 0)
    gone_ = fmt::format("earlier logs of this run were deleted or moved, {} confirmed events are gone", gone);
  return gone;
}

void Recorder::StartAnew(std::int64_t now_us) {
  const std::string lost = log_file_;
  try {
    directory_.Make();
    Open(now_us, lost);
    is_log_lost_ = false;
    const auto move_to_new = [this](auto& rows) {
      for (auto& row : rows) row.event.log_file = log_file_;
    };
    move_to_new(rows_.decisions);
    move_to_new(rows_.events);
    move_to_new(rows_.gaps);
    move_to_new(rows_.transitions);
    database().EndRun(lost, now_us, gone_.empty() ? "the log was lost while it was written" : gone_);
  } catch (const BadInput& error) {
    if (!is_log_lost_) {
      logging::Error("{} is left to the next start to end: {}", lost, error.what());
      return;
    }
    log_->Abandon();
    for (const auto& [channel, events] : std::exchange(unflushed_, {}))
      CountLoss({channel, ""}, events, now_us, "gone");
    rows_ = WithoutEvents(std::move(rows_));
    pause_ = "gone";
    anew_problem_ = fmt::format("the log is gone, and there is no new one: {}", error.what());
    anew_.Start(now_us);
  }
}

void Recorder::WatchDatabase(std::int64_t now_us) {
  if (database_) {
    const std::optional<std::string> displaced = database_->FindDisplaced();
    if (!displaced) return;
    logging::Error("database: {}; it is opened again", *displaced);
    database_problem_ = displaced_ = fmt::format("database: {}", *displaced);
    database_->Checkpoint();
    database_.reset();
  }
  if (!database_anew_.IsOver(now_us)) return;
  try {
    OpenDatabaseAnew();
  } catch (const BadInput& error) {
    database_problem_ = error.what();
    database_anew_.Start(now_us);
  }
}

void Recorder::OpenDatabaseAnew() {
  directory_.Make();
  auto database = std::make_unique<Database>(database_path_);
  const std::vector<RunRow> runs = database->Runs();
  const auto run = std::ranges::find(runs, log_file_, &RunRow::log_file);
  const bool lacks_rows = run == runs.end() || run->events < told_events_;
  if (run == runs.end()) database->BeginRun(log_file_, begun_us_, continues_, robot());
  database_ = std::move(database);
  if (!lacks_rows) return;
  gone_ = fmt::format("{}, with the gaps that only it held", displaced_);
  rows_lost_ = needs_new_file_ = true;
  are_rows_behind_ |= std::ranges::any_of(directory_.Logs(), [&](const std::string& log) {
    return log == log_file_ || std::ranges::find(runs, log, &RunRow::log_file) == runs.end();
  });
}

bool Recorder::Flush(std::int64_t now_us) {
  const auto begun = std::chrono::steady_clock::now();
  flush_.Start(now_us);
  WatchFiles(now_us);
  // An empty flush does not test the disk, so a failure lasts until a flush has written something.
  const bool learns = log_->pending_bytes() > 0 || !pause_.empty();
  const bool flushed = FlushLog(now_us);
  WatchDisk(now_us);
  if (!flushed || !pause_.empty())
    failed_flushes_ = std::min(failed_flushes_ + 1, INT16_MAX);
  else if (learns)
    failed_flushes_ = 0;
  if (!losses_.empty() && (recording() || gaps_.IsOver(now_us))) MakeGaps(now_us);
  summary_.Add(rows_);
  std::ranges::move(rows_.decisions, std::back_inserter(flushed_rows_.decisions));
  std::ranges::move(rows_.events, std::back_inserter(flushed_rows_.events));
  std::ranges::move(rows_.gaps, std::back_inserter(flushed_rows_.gaps));
  std::ranges::move(rows_.transitions, std::back_inserter(flushed_rows_.transitions));
  rows_ = {};
  WriteRows();
  flush_us_ = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begun).count();
  worst_flush_us_ = std::max(worst_flush_us_, flush_us_);
  Report();
  return flushed;
}

bool Recorder::FlushLog(std::int64_t now_us) {
  const bool flushed = log_->Flush();
  if (!flushed) rows_ = WithoutEvents(std::move(rows_));
  for (const auto& [channel, events] : std::exchange(unflushed_, {}))
    if (flushed) {
      written_ += events;
      Count(confirmed_, channel, events);
    } else {
      CountLoss({channel, ""}, events, now_us, "disk");
    }
  return flushed;
}

void Recorder::WriteRows() {
  if (flushed_rows_.empty()) return;
  const std::int64_t events = rows_lost_ ? 0 : log_->next_number();
  if (database_ && database_->Write(flushed_rows_, log_file_, events)) {
    flushed_rows_ = {};
    told_events_ = events;
  } else if (flushed_rows_.size() > kMaxWaitingRows) {
    // The log has the events, so the next start makes their rows; of gaps nothing else knows.
    rows_lost_ = true;
    flushed_rows_ = {{}, {}, MergedWithoutEvents(flushed_rows_.gaps), {}};
  }
}

std::string Recorder::trouble() const {
  if (pause_ == "quota") return fmt::format("paused: the logs have reached logger.quota_mb, {}", *options_.quota_mb);
  if (pause_ == "gone") return anew_problem_;
  if (!pause_.empty()) return fmt::format("paused: less than logger.min_free_mb, {}, is free", options_.min_free_mb);
  if (failed_flushes_ > 0) return log_->problem();
  if (!database_) return database_problem_;
  if (!flushed_rows_.empty()) return database_->problem();
  if (rows_lost_ || are_rows_behind_) return "rows are missing in the database, the next start makes them again";
  if (is_log_hidden_) return fmt::format("whether {} is in its place cannot be seen", log_path_);
  return rotation_problem_;
}

void Recorder::Report() {
  const std::string now = trouble();
  if (now == reported_) return;
  if (now.empty())
    logging::Info("{} can be written again", options_.directory);
  else
    logging::Error("{}; what is lost is counted", now);
  reported_ = now;
}

void Recorder::End(std::int64_t now_us) {
  static_cast<void>(CountEarlierFilesGone(now_us));
  MakeGaps(now_us);
  if (Flush(now_us); !losses_.empty()) {  // of this last flush
    MakeGaps(now_us);
    Flush(now_us);
  }
  // A run with missing rows is not ended, so that the next start makes them again from the log.
  if (flushed_rows_.empty() && !rows_lost_) try {
      database().EndRun(log_file_, now_us);
    } catch (const DatabaseError& error) {
      logging::Error("{} is left to the next start to end: {}", log_file_, error.what());
    }
}

// A pause ends with a margin of an eighth, so that it does not end and begin at every flush.
void Recorder::WatchDisk(std::int64_t now_us) {
  free_bytes_ = free_space_(directory_.path());
  if (scan_.IsOver(now_us)) {
    other_bytes_ = directory_.LogBytes(log_file_);
    scan_.Start(now_us);
  }
  const std::int64_t floor = BytesOf(options_.min_free_mb), quota = BytesOf(options_.quota_mb.value_or(0));
  const bool was_quota = pause_ == "quota";
  if (is_log_lost_)
    pause_ = "gone";
  else if (free_bytes_ < floor + (pause_ == "disk" ? floor / 8 : 0))
    pause_ = "disk";
  else
    pause_ = MakeRoom(was_quota ? quota / 8 : 0, now_us) ? "" : "quota";
}

bool Recorder::HasRoom(std::int64_t bytes) const {
  return !options_.quota_mb || log_bytes() + bytes <= BytesOf(*options_.quota_mb);
}

// Deletes the oldest ended logs until there is room. Deletes none if all of them together would not make enough room.
bool Recorder::MakeRoom(std::int64_t bytes, std::int64_t now_us) {
  if (HasRoom(bytes)) return true;
  other_bytes_ = directory_.LogBytes(log_file_);
  try {
    struct Ended {
      std::int64_t start_utime;
      std::string file;
      std::int64_t bytes;
    };
    std::vector<Ended> ended;
    std::int64_t ended_bytes = 0;
    for (const RunRow& run : database().Runs()) {
      const auto size = directory_.Bytes(run.log_file);
      if (!run.end_utime || run.log_file == log_file_ || !size) continue;
      ended.push_back({run.start_utime, run.log_file, *size});
      ended_bytes += *size;
    }
    if (!HasRoom(bytes - ended_bytes)) return false;
    std::ranges::stable_sort(ended, {}, &Ended::start_utime);  // an old log may have got its run late
    for (const auto& [start_utime, file, size] : ended) {
      if (HasRoom(bytes)) break;
      // Marked first: readers tell a log that was deleted for the quota from one that is gone.
      database().MarkLogDeleted(file, now_us);
      earlier_files_.erase(file);
      if (!directory_.Remove(file)) continue;
      other_bytes_ -= size;
      ForgetTasksOf(file);
      logging::Warn("{}, {} bytes, deleted for logger.quota_mb; its rows stay", file, size);
    }
  } catch (const DatabaseError& error) {
    logging::Error("no log is deleted for logger.quota_mb: {}", error.what());
  }
  return HasRoom(bytes);
}

}  // namespace forereach
