/** The certifier on a bus: candidates in; decisions, certified plans and a heartbeat out.

Every candidate is answered once. The newest is decided on first, since it is the one that a planner still wants. Those
that wait are answered before their deadline passes, and of more than `gate.queue` the oldest are rejected. What changes
the grounds of decisions takes effect as it arrives: obstacles, the robot's state, executed transitions, commands.

Unless gate.arming is none, nothing is certified before the robot's state is heard. A fault (watch.h, conformance.h, a
falsified declaration) is sent on bus.channels.fault, with every heartbeat again, and from then on every candidate is
rejected until a person sends a reset, which has to be later than the fault. A reload reads the task file again, beside
the running work, and takes it whole or not at all; what cannot change while it runs, WhyNotTaken says.

First goes out the certified plan, which the robot waits for, then the decision: a planner that hears of a certificate
knows that the plan was handed to the bus before. */
#pragma once

#include <array>
#include <deque>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "certifier/gate/conformance.h"
#include "certifier/gate/gate.h"
#include "certifier/gate/watch.h"
#include "certifier/task/reloading.h"
#include "forereach/command_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/node.h"

namespace forereach {

/** A wall clock and one that nobody sets, both in microseconds. A simulation gives the same for both. */
struct Clocks {
  Clock wall = WallClockUs;
  Clock steady = SteadyClockUs;
};

class CertifierNode final : public Node {
 public:
  static constexpr std::int64_t kHeartbeatUs = 500'000;
  static constexpr int kAtOnce = 8;  ///< Candidates decided on before the bus is looked at again.

  CertifierNode(const Config& config, Bus& bus, Clocks clocks = {});
  ~CertifierNode() override;

  void Tick(std::int64_t now_us) override;
  [[nodiscard]] bool busy() const override { return !queue_.empty(); }
  void Reload() override;
  /** Answers what waits still, and prints the counts as one line of JSON on standard output. */
  void Stop() override;

  [[nodiscard]] const Gate& gate() const { return *gate_; }
  [[nodiscard]] const Watch& watch() const { return watch_; }

 private:
  struct Loaded {
    Config config;
    std::unique_ptr<Gate> gate;
    std::string error;  ///< Else there are a config and its gate.
  };

  void OnObstacles(const Received& received);
  void OnRobotState(const Received& received);
  void OnTransition(const Received& received);
  void OnCommand(const Received& received);
  void Obey(const command_t& command, std::int64_t now_us);

  void AnswerWaiting();
  void AnswerDue();
  [[nodiscard]] GateAnswer Decide(Bytes candidate);
  void Answer(Bytes candidate, bool displaced);
  void CompactIfDue();
  [[nodiscard]] static Loaded Load(const std::string& path, const BusOptions& in_force);
  void TakeReload();
  /** Why a task file, good in itself, cannot take the place of the one in force; empty if it can. */
  [[nodiscard]] std::string WhyNotTaken(const Config& config) const;

  /** Latches and announces, unless a fault as grave is latched already. */
  void Fail(fault_t fault, const std::string& why);
  void Announce(fault_t fault, const Watch::Fault& latched);
  void SendFault();
  void Learn(Bytes transition);
  void FailIfLeft(const std::optional<Conformance::Departure>& departure);
  void Refuse(const std::string& channel, const std::string& why);

  void Heartbeat(std::int64_t now_us);
  [[nodiscard]] std::string WhyNotOk() const;
  [[nodiscard]] double ElapsedPercentile(double fraction) const;

  const std::string config_path_;
  const BusOptions channels_;
  const RealtimeOptions realtime_;
  const Clocks clocks_;
  Bus& bus_;
  Sender sender_;
  std::unique_ptr<Gate> gate_;
  Watch watch_;
  Conformance conformance_;

  struct Waiting {
    std::vector<std::uint8_t> candidate;
    std::optional<std::int64_t> start_utime = {};  // known once another was decided on before it
  };

  std::deque<Waiting> queue_;  // the newest at the back
  robot_state_t last_state_{};
  transition_t last_transition_{};

  fault_t announced_{};                // the last fault, sent again while it is latched: a datagram may be lost
  std::int64_t next_announcement_us_ = 0;  // by the steady clock

  Reloading<Loaded> reload_;
  std::future<void> compaction_;  // of *gate_
  struct Falsified {
    Digest model;
    Observations pair;  // with an executed transition
  };
  std::vector<Falsified> falsified_;  // one at most for each version of the task
  std::int64_t version_ = 1, failed_reloads_ = 0;
  std::string reload_error_;

  std::int64_t next_heartbeat_us_ = 0, next_warning_us_ = 0;  // by the steady clock
  std::int64_t heartbeats_ = 0, faults_ = 0, refused_ = 0, page_faults_ = 0;
  std::size_t high_water_ = 0;
  std::array<double, 1024> elapsed_us_{};  // of the last decisions, a ring
  std::size_t decided_ = 0;
};

}  // namespace forereach
