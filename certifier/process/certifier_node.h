/** The certifier on a bus: candidates in; decisions, certified plans and a heartbeat out.

Every candidate is answered once. The newest is decided on first, since it is the one that a planner still wants. Those
that wait are answered before their deadline passes, and of more than `gate.queue` the oldest are rejected. What changes
the grounds of decisions takes effect as it arrives: obstacles, the robot's state, executed transitions, commands.

Unless gate.arming is none, nothing is certified before the robot's state is heard. A fault (watch.h, conformance.h, a
falsified declaration) is sent on bus.channels.fault, with every heartbeat again, and from then on every candidate is
rejected until a person sends a reset, which has to be later than the fault. A reload reads the task file again
(task_reload.h).

Of several certifiers on one bus one is in charge (charge.h). The others say nothing but their heartbeat. What they hear
before they take charge they do not learn: one that takes charge knows as much as one that has just been started.

With a latch file (latch_file.h) a fault is handed to the kernel before it is announced, and written to the disk right
after. The next certifier begins with the same fault, and says it again. While no fault could be written, every
candidate is rejected (CAUSE_LATCH_UNWRITABLE); a reset that cannot be written clears nothing. What has contradicted a
declaration is kept there too, over resets: candidates under a declaration that it contradicts get F.

First goes out the certified plan, which the robot waits for, then the decision: a planner that hears of a certificate
knows that the plan was handed to the bus before. */
#pragma once

#include <array>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus/node.h"
#include "certifier/gate/charge.h"
#include "certifier/gate/conformance.h"
#include "certifier/gate/gate.h"
#include "certifier/gate/issued_plans.h"
#include "certifier/gate/watch.h"
#include "certifier/process/candidate_queue.h"
#include "certifier/process/contradictions.h"
#include "certifier/process/fault_latch.h"
#include "certifier/process/latch_file.h"
#include "certifier/process/task_reload.h"
#include "forereach/certifier_status_v3_t.hpp"
#include "forereach/command_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/robot_state_t.hpp"

namespace forereach {

/** A wall clock and one that nobody sets, both in microseconds. A simulation gives the same for both. */
struct Clocks {
  Clock wall = WallClockUs;
  Clock steady = SteadyClockUs;
};

struct FoundFault;

class CertifierNode final : public Node {
 public:
  static constexpr std::int64_t kHeartbeatUs = 500'000;
  static constexpr std::int64_t kHeartbeatToOthersUs = 100'000;  ///< While it listens for others, and to one that does.
  static constexpr std::size_t kHeldAtMost = 4096;               ///< Candidates that wait while it listens for others.
  static constexpr int kAtOnce = 8;  ///< Candidates decided on before the bus is looked at again.

  /** @param listen_us how long it listens for another certifier before it takes charge; Charge::kListenUs on a bus that
  others can be on. @param latch may be null: then a restart forgets a fault. @throws ConfigError if the task does not
  say gate.obstacles. */
  CertifierNode(const Config& config, Bus& bus, Clocks clocks = {}, std::int64_t listen_us = 0,
                std::unique_ptr<LatchFile> latch = nullptr);
  ~CertifierNode() override;

  void Tick(std::int64_t now_us) override;
  [[nodiscard]] bool busy() const override { return !queue_.empty() && is_in_charge(); }
  void Reload() override;
  /** Answers what waits still, and prints the counts as one line of JSON on standard output. */
  void Stop() override;

  [[nodiscard]] const Gate& gate() const { return *gate_; }
  [[nodiscard]] const Watch& watch() const { return watch_; }
  [[nodiscard]] const Charge& charge() const { return charge_; }

 private:
  [[nodiscard]] bool is_in_charge() const { return charge_.state() == Charge::State::kInCharge; }
  void OnCandidate(const Received& received);
  void OnStatus(const Received& received);
  void Heed(const certifier_status_v3_t& status);
  void OnFault(const Received& received);
  void LookAtCharge();
  void FollowCharge(Charge::State before);
  void TakeCharge();
  void StandBy();
  void LeaveWaiting();
  [[nodiscard]] std::string WhyNotInCharge() const;
  void LookForObstacles(std::int64_t now_us);

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
  void TakeReload();
  /** Latches and announces, unless a fault as grave is latched already. */
  void Fail(const FoundFault& found);
  void Announce(fault_t fault, const Watch::Fault& latched);
  void SendFault();
  void Learn(Bytes transition);

  void Refuse(const std::string& channel, const std::string& why);

  void Heartbeat(std::int64_t now_us);
  [[nodiscard]] std::string WhyNotOk() const;
  [[nodiscard]] double ElapsedPercentile(double fraction) const;

  Config config_;  // in force
  const BusOptions channels_;
  const Clocks clocks_;
  Bus& bus_;
  Sender sender_;
  std::unique_ptr<Gate> gate_;
  Watch watch_;
  Charge charge_;
  bool has_begun_ = false;                      // has been in charge, and no other since
  std::optional<Watch::Fault> fault_of_other_;  // of the one in charge, by its last heartbeat
  std::int64_t left_to_other_ = 0;              // candidates
  bool obstacles_refused_ = false;              // since the last heartbeat, for gate.obstacles is task
  Conformance conformance_;
  IssuedPlans issued_;

  CandidateQueue queue_;
  robot_state_t last_state_{};
  transition_t last_transition_{};

  TaskReload reload_;
  std::future<void> compaction_;  // of *gate_
  Contradictions contradictions_;
  FaultLatch latch_;
  std::int64_t next_heartbeat_us_ = 0, next_warning_us_ = 0;  // by the steady clock
  std::int64_t last_heartbeat_us_ = 0;
  std::int64_t heartbeats_ = 0, heartbeats_aside_ = 0, faults_ = 0, refused_ = 0, page_faults_ = 0;
  std::array<double, 1024> elapsed_us_{};  // of the last decisions, a ring
  std::size_t decided_ = 0;
};

}  // namespace forereach
