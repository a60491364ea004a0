/** A logger's node on a bus without threads and on a disk of a test's choice, and what it left there. */
#pragma once

#include <unistd.h>

#include "logger/logger_node.h"
#include "tests/logger/direct_bus.h"
#include "tests/records/logs.h"
#include "tests/records/sql.h"
#include "tests/small_disk.h"

namespace forereach {

inline constexpr std::int64_t kRecord = 28 + 15 + 336;  // of an execution event

struct DiskTest : testing::Test {
  DiskTest() {
    config_.logger.directory = scratch_ / "log";
    config_.logger.flush_ms = 10;
    config_.logger.min_free_mb = 1;
  }

  void TearDown() override { ExpectRowsOfTheLogs(config_.logger.directory); }

  LoggerNode& Start() {
    return node_.emplace(config_, bus_, out_, [this](const std::string&) { return free_bytes_; });
  }
  /** `count` execution events in a row, one a millisecond, and a tick after each. */
  void Feed(int count) {
    for (int i = 0; i < count; ++i) {
      bus_.Publish("EXECUTION_EVENT", MakeEvent(fed_++, execution_event_t::STARTED));
      node_->Tick(bus_.now_us += 1000);
    }
  }
  void Stop() {
    node_->Stop();
    node_.reset();
    bus_.Disconnect();
  }
  [[nodiscard]] std::string PathOf(const RunRow& run) const { return scratch_ / ("log/" + run.log_file); }
  [[nodiscard]] std::vector<RunRow> Runs() const { return Database(scratch_ / "log/decisions.sqlite").Runs(); }
  [[nodiscard]] Rows ReadRows() const { return Database(scratch_ / "log/decisions.sqlite").Read(); }
  /** Sequence numbers of the execution events in all logs that are there, in order. */
  [[nodiscard]] std::vector<std::int64_t> Recorded() const {
    std::vector<std::int64_t> sequences;
    for (const RunRow& run : Runs()) {
      if (!std::filesystem::exists(PathOf(run))) continue;
      for (const LogEvent& event : ReadLog(PathOf(run)).events)
        if (const auto execution = Decoded<execution_event_t>(event.data)) sequences.push_back(execution->sequence);
    }
    return sequences;
  }
  [[nodiscard]] std::int64_t LostTo(const std::string& reason) const { return LostTo(reason, ReadRows()); }
  [[nodiscard]] static std::int64_t LostTo(const std::string& reason, const Rows& rows) {
    std::int64_t lost = 0;
    for (const GapRow& gap : rows.gaps) lost += gap.reason == reason ? gap.lost : 0;
    return lost;
  }
  void Sql(const std::string& statement) const { forereach::Sql(scratch_ / "log/decisions.sqlite", statement); }
  [[nodiscard]] const logger_status_t& last() const { return bus_.heartbeats.back(); }

  static std::vector<std::int64_t> UpTo(std::int64_t end) {
    std::vector<std::int64_t> numbers(static_cast<std::size_t>(end));
    std::ranges::generate(numbers, [n = std::int64_t{0}]() mutable { return n++; });
    return numbers;
  }

  ScratchDirectory scratch_;
  Config config_;
  DirectBus bus_;
  std::ostringstream out_;
  std::int64_t free_bytes_ = std::int64_t{1} << 40, fed_ = 0;
  std::optional<LoggerNode> node_;
};

}  // namespace forereach
