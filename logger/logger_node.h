/** Records the bus: all messages in LCM event logs; decisions, execution events and gaps in the database
(logger/recorder.h describes the files and possible losses). It sends a heartbeat with its state.

Handlers only copy messages into a bounded queue, and Tick takes them from it, so the disk never blocks the bus.
Messages that do not fit are dropped, counted, and become a gap.

With keys, a stranger on the network can neither fill the disk nor displace authentic logs. All authentic messages are
recorded, with their trailer. Refused messages, and messages on channels that do not belong to ForeReach, are recorded
only up to logger.unsigned_kb_per_s. Refused messages make no rows, unless their signatures hold; the heartbeat's
sentence and the summary at Stop have their number. Messages of other channels above the limit become gaps "unsigned".
*/
#pragma once

#include <cstdint>
#include <deque>
#include <iosfwd>
#include <map>
#include <string>

#include "bus/bus.h"
#include "bus/node.h"
#include "logger/recorder.h"
#include "task/config.h"

namespace forereach {

class LoggerNode final : public Node {
 public:
  static constexpr std::int64_t kHeartbeatUs = 500'000;
  static constexpr std::int64_t kSilenceUs = 2'000'000;  ///< Without a message this long the bus counts as silent.

  /** Opens the database, repairs earlier runs and subscribes to all channels.
  @param out receives the summary at Stop. @throws LogError, DatabaseError if the directory cannot be written to,
  KeyError if bus.key cannot be used. */
  LoggerNode(const Config& config, Bus& bus, std::ostream& out, FreeSpace free_space = FreeBytes);

  /** The first call opens the log file, named after its time. @throws LogError, DatabaseError if it cannot. */
  void Tick(std::int64_t now_us) override;
  void Stop() override;
  /** True if recorded events are missing from the disk; see Recorder::gone. */
  [[nodiscard]] bool failed() const override { return !recorder_.gone().empty(); }

  [[nodiscard]] const Recorder& recorder() const { return recorder_; }

 private:
  void Receive(const Received& received);
  [[nodiscard]] bool MayTakeUnsigned(std::size_t bytes);
  [[nodiscard]] Refusals refusals() const;
  void Drain(std::int64_t now_us);
  void SendStatus(std::int64_t now_us, std::int64_t queue_depth);
  [[nodiscard]] std::string Silence(std::int64_t now_us) const;

  const BusOptions channels_;
  const std::size_t queue_size_;
  Bus& bus_;
  std::ostream& out_;
  Recorder recorder_;

  std::deque<LogEvent> queue_;
  std::map<Stream, std::int64_t> overflow_;  // dropped since the last Tick
  std::int64_t bus_dropped_;                 // at the last Tick
  const Speakers speakers_;                  // empty without keys
  const double unsigned_bytes_per_us_;
  double unsigned_allowance_ = 0;  // bytes
  std::int64_t allowance_us_ = 0, unsigned_lost_ = 0;
  bool authentic_heard_ = false;
  std::size_t high_water_ = 0;  // of the queue since the last heartbeat
  std::int64_t now_us_ = 0, last_heard_us_ = 0, heartbeats_ = 0;
  Period heartbeat_{kHeartbeatUs};
};

}  // namespace forereach
