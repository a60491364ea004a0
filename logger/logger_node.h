/** Records everything the bus carries: all messages in an LCM event log, decisions, execution events and gaps in the
database. One log file a run, one database a directory.

Handlers only copy into a bounded queue; Tick brings it to the log's buffer; every logger.flush_ms the buffer goes to
the file (write, then fdatasync) and after it the rows of those events go to the database in one transaction. So the
database never knows more than the log, and a logger that is killed loses at most what came since the last flush, a
machine that loses power the same. What does not fit the queue is dropped, counted and becomes a gap; a full disk costs
the events of that flush, which become gaps too, and recording goes on. On start, runs that did not end are mended: the
log's cut tail is removed and missing rows are made again from the log. */
#pragma once

#include <cstdint>
#include <deque>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "certifier/task/config.h"
#include "lcmtypes/bus.h"
#include "lcmtypes/node.h"
#include "logger/database.h"
#include "logger/event_log.h"
#include "logger/interpreter.h"
#include "logger/summary.h"

namespace forereach {

class LoggerNode final : public Node {
 public:
  /** Makes config.logger.directory if need be, opens the database in it, mends earlier runs and subscribes to all.
  @param out where Stop prints the summary. @throws LogError, DatabaseError if the directory cannot be written to. */
  LoggerNode(const Config& config, Bus& bus, std::ostream& out);

  /** The first call opens the log file, named after its time. @throws LogError, DatabaseError if it cannot. */
  void Tick(std::int64_t now_us) override;
  void Stop() override;

  /** One line for each earlier run that was mended. */
  [[nodiscard]] const std::vector<std::string>& recovered() const { return recovered_; }
  /** Empty before the first Tick. */
  [[nodiscard]] const std::string& log_path() const { return log_path_; }
  [[nodiscard]] const Database& database() const { return database_; }
  [[nodiscard]] Summary summary() const { return summary_.Finish(); }

 private:
  struct Stored {
    std::int64_t utime;
    std::string channel;
    std::vector<std::uint8_t> bytes;
  };

  void Receive(const Received& received);
  void Recover(const RunRow& run);
  void Open(std::int64_t now_us);
  void Drain(std::int64_t now_us);
  void Record(Stored stored);
  void AddGap(const Stream& stream, std::int64_t lost, std::int64_t utime, const std::string& reason);
  void Flush(std::int64_t now_us);
  void WriteRows();
  void Report(bool failed, const std::string& problem);

  Bus& bus_;
  std::ostream& out_;
  const BusOptions channels_;
  const LoggerOptions options_;
  Database database_;
  SummaryBuilder summary_;
  std::vector<std::string> recovered_;

  std::string log_path_, log_file_;
  std::optional<EventLogWriter> log_;
  std::optional<Interpreter> interpreter_;

  std::deque<Stored> queue_;
  std::map<Stream, std::int64_t> overflow_;            // dropped since the last Tick
  std::int64_t bus_dropped_ = 0;                       // as of the last Tick
  std::map<std::string, std::int64_t> unflushed_;      // events in the log's buffer, by channel
  Rows flushed_rows_, rows_;                           // of events on disk; of events in the log's buffer
  std::int64_t next_flush_us_ = 0, now_us_ = 0;
  bool failing_ = false, rows_lost_ = false;
};

}  // namespace forereach
