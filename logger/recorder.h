/** Writes messages to log files and the database, rotates the files, and limits the disk usage. It uses no bus.

**Loss window.** Take puts a message into the log's buffer. Every logger.flush_ms the buffer is written to the file
(write, then fdatasync); then the rows of these events are written to the database in one transaction. So the database
never has more events than the log, and a killed recorder loses at most the messages since the last flush. The same
holds for a power failure, because a log's directory entry and its run are on the disk before its first event. At its
start the recorder repairs log files that were not ended: it removes a cut tail and makes missing rows again. It does
the same with files that have a logger's name and belong to no run, unless another logger is writing them. Rows that the
database refuses wait. Above kMaxWaitingRows, rows that come from an event are dropped, and the next start makes them
again. Gaps without an event, which no log holds, continue to wait; those of one stream and reason are merged. Their
losses are not counted again when the log is read again.

**Files.** Each file has one row in the database's table runs. The next file begins before an event that would make the
current one exceed logger.rotate_mb, after logger.rotate_minutes, and when logger.quota_mb leaves no room. Event numbers
restart; sequence counts and waiting candidates continue. A file is not ended before the database has all of its rows.

**Files that disappear.** At each flush the recorder checks the log and the database. If the log was deleted, moved,
replaced or cut short, it is given up: events that the disk had confirmed and that cannot be read at their place any
more are counted as gaps "gone". A new file continues with the events that wait in memory, under their existing numbers.
The directory is made again if necessary. If no new file can be made, recording pauses and the recorder tries again
every second. A missing database is opened or made again. The next start makes its missing rows again from the logs;
gaps without an event, which only the database held, are lost.

**Tasks.** Copies of the task file, and of the files that it names, are kept next to the logs (records/kept_tasks.h), so
that a log can be read without the originals. When the certifier's heartbeats report a reload, the task file is read
again and kept if its digest is the reported one. A kept task is deleted with the last log whose decisions name it.

**Full disk.** With less than logger.min_free_mb free, or no room within logger.quota_mb, recording pauses: messages are
counted by channel, and the counts become gaps. The same happens to the events of a failed flush. These gaps are written
when recording resumes, and every ten seconds until then. For the quota the logs of ended runs are deleted, oldest
first, after each is marked in the database. The current file and runs that were not ended are never deleted. No log is
deleted if that would not make enough room. */
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bus/authentic.h"
#include "records/database.h"
#include "records/event_log.h"
#include "records/interpreter.h"
#include "records/kept_tasks.h"
#include "records/log_directory.h"
#include "records/summary.h"
#include "task/config.h"

namespace forereach {

/** Free bytes of a directory's disk. */
using FreeSpace = std::function<std::int64_t(const std::string& directory)>;

/** A period on a clock that may jump. It is over once it has passed since the start, and if the clock is set back
before the start. */
class Period final {
 public:
  explicit Period(double us) : us_(static_cast<std::int64_t>(us)) {}
  void Start(std::int64_t now_us) { start_ = now_us; }
  [[nodiscard]] bool IsOver(std::int64_t now_us) const {
    return !start_ || now_us < *start_ || now_us - *start_ >= us_;
  }

 private:
  std::int64_t us_;
  std::optional<std::int64_t> start_;
};

class Recorder final {
 public:
  static constexpr std::size_t kMaxWaitingRows = 20'000;

  /** Makes the directory if necessary, opens the database in it and repairs earlier runs. With bus.key only authentic
  messages make rows (records/interpreter.h).
  @throws LogError, DatabaseError if the directory cannot be written to, KeyError. */
  Recorder(const Config& config, FreeSpace free_space);

  /** Opens the first log file, named after its time. Call it before the functions below. @throws as the constructor. */
  void Begin(std::int64_t now_us);
  [[nodiscard]] bool begun() const { return log_ != nullptr; }
  [[nodiscard]] bool has_keys() const { return keys_.has_value(); }

  /** The next message; its `number` is not read. */
  void Take(LogEvent event, std::int64_t now_us);
  /** Notes that the next `lost` messages of the stream reached this process but not Take. They make one gap. */
  void Lose(const Stream& stream, std::int64_t lost, std::int64_t utime, const std::string& reason);
  /** Flushes and rotates if due. */
  void Tick(std::int64_t now_us);
  /** Flushes and ends the run. Call no function after it. */
  void End(std::int64_t now_us);

  [[nodiscard]] const Interpreter& interpreter() const { return interpreter_; }
  [[nodiscard]] const std::string& database_path() const { return database_path_; }
  [[nodiscard]] Summary summary() const { return summary_.Finish(); }
  /** One line for each earlier run that was repaired. */
  [[nodiscard]] const std::vector<std::string>& recovered() const { return recovered_; }
  [[nodiscard]] const std::string& log_path() const { return log_path_; }
  /** Log files of this run. */
  [[nodiscard]] int files() const { return files_; }

  [[nodiscard]] bool recording() const { return pause_.empty() && failed_flushes_ == 0; }
  /** The problem as a sentence; empty if there is none. */
  [[nodiscard]] std::string trouble() const;
  /** Number of consecutive flushes that failed or found recording paused. */
  [[nodiscard]] int failed_flushes() const { return failed_flushes_; }
  /** The last loss of recorded events from the disk in this run's files, as a sentence; empty if there was none. */
  [[nodiscard]] const std::string& gone() const { return gone_; }
  /** The number of events that the disk confirmed, and the number of messages that are in no log, because they
  disappeared or were never written. */
  [[nodiscard]] std::int64_t written() const { return written_; }
  [[nodiscard]] std::int64_t lost() const { return lost_; }
  [[nodiscard]] std::int64_t file_bytes() const { return log_->offset() + log_->pending_bytes(); }
  [[nodiscard]] std::int64_t log_bytes() const { return other_bytes_ + file_bytes(); }
  [[nodiscard]] std::int64_t free_bytes() const { return free_bytes_; }
  /** Wall-clock time of the last flush, and of the worst since the last call of TakeWorstFlushUs. */
  [[nodiscard]] double flush_us() const { return flush_us_; }
  [[nodiscard]] double TakeWorstFlushUs() { return std::exchange(worst_flush_us_, 0); }

 private:
  /** Its name in the keys; empty without keys. */
  [[nodiscard]] std::string robot() const { return keys_ ? keys_->robot() : ""; }
  struct Loss {
    std::int64_t lost = 0, first_utime = 0;
  };
  using Counts = std::map<std::string, std::int64_t>;  // by channel, the channels bounded in number

  void AdoptLogs();
  void Recover(const RunRow& run);
  [[nodiscard]] std::string Mend(const RunRow& run, std::int64_t& end_utime);
  [[nodiscard]] Interpreter InterpreterFor(const RunRow& run) const;

  void Open(std::int64_t now_us, const std::string& continues);
  void Rotate(std::int64_t now_us);
  void Miss(LogEvent event);
  void CountLoss(const Stream& stream, std::int64_t lost, std::int64_t utime, const std::string& reason);
  void MakeGaps(std::int64_t now_us);

  void WatchFiles(std::int64_t now_us);
  void WatchDatabase(std::int64_t now_us);
  void OpenDatabaseAnew();
  void GiveUpLog(FilePlace place, std::int64_t now_us);
  void StartAnew(std::int64_t now_us);
  [[nodiscard]] std::int64_t CountEarlierFilesGone(std::int64_t now_us);
  [[nodiscard]] Database& database();

  bool Flush(std::int64_t now_us);
  [[nodiscard]] bool FlushLog(std::int64_t now_us);
  void WriteRows();
  void Report();

  void NoticeTask(const LogEvent& event, std::int64_t now_us);
  void AddTask(const Config& config);
  void KeepTasks() const;
  void ForgetTasksOf(const std::string& log);

  void WatchDisk(std::int64_t now_us);
  [[nodiscard]] bool HasRoom(std::int64_t bytes) const;
  [[nodiscard]] bool MakeRoom(std::int64_t bytes, std::int64_t now_us);

  const BusOptions channels_;
  const LoggerOptions options_;
  const std::optional<KeyRing> keys_;
  const FreeSpace free_space_;
  const LogDirectory directory_;
  const std::string database_path_;
  std::unique_ptr<Database> database_;  // nothing while it cannot be opened anew
  SummaryBuilder summary_;
  Interpreter interpreter_;
  std::vector<std::string> recovered_;

  const std::string task_path_;
  const KeptTasks kept_tasks_;
  std::vector<TaskCopy> tasks_;                                // of this run, the last kMaxTasks
  std::optional<std::pair<Digest, std::int64_t>> heard_task_;  // config digest and version of the last heartbeat
  std::set<std::string> tasks_in_use_;                         // config digests of this run, in hexadecimal
  Period task_reading_;

  std::string log_path_, log_file_;
  std::unique_ptr<EventLogWriter> log_;
  int files_ = 0;
  std::int64_t name_us_ = 0;  // the time that the last of them is named after
  std::string continues_;
  std::int64_t begun_us_ = 0;
  Period flush_, age_, scan_, gaps_, retry_, anew_, database_anew_;

  Counts unflushed_;                                   // events in the log's buffer
  Counts confirmed_;                                   // events that the disk has confirmed of this file
  std::map<std::string, std::int64_t> earlier_files_;  // of this run, with their events
  bool is_log_lost_ = false;                           // and no new one could be made
  bool is_log_hidden_ = false;                         // whether it is in its place cannot be seen
  std::string gone_;
  Rows flushed_rows_, rows_;                               // of events on disk; of events in the log's buffer
  bool rows_lost_ = false;                                 // some of this file, to be made again by the next start
  std::map<std::pair<std::string, Stream>, Loss> losses_;  // by reason; no gaps yet
  std::string pause_;                                      // the reason of the gaps it makes; empty while recording
  std::int64_t told_events_ = 0;                           // of this file, to the database
  bool needs_new_file_ = false;                            // the database has not all rows of this one
  bool are_rows_behind_ = false;                           // of earlier files, to be made again by the next start
  std::string rotation_problem_, anew_problem_, database_problem_, displaced_, reported_;
  int failed_flushes_ = 0;
  std::int64_t written_ = 0, lost_ = 0, other_bytes_ = 0, free_bytes_ = 0;
  double flush_us_ = 0, worst_flush_us_ = 0;
};

}  // namespace forereach
