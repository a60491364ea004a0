/** The certifier on a bus: candidates in; decisions, certified plans and a heartbeat out.

The node wires the classes that each answer one question; how they work is said there:

    candidate_queue.h   which candidate is decided next; Gate (gate/gate.h) decides
    watch.h             whether anything may be certified now, and which fault is latched
    fault_latch.h       the latched fault as a message, and what outlives the process (latch_file.h)
    contradictions.h    which declarations are known to be false
    plan_ledger.h       which plans were certified, which of them may be executed, what of them is withdrawn, and
                        whether the robot keeps to them
    charge.h            which of several certifiers on one bus decides
    task_reload.h       which task is in force
    status_reporter.h   what the heartbeat reports, and when
    advice_giver.h      what would have helped a candidate, said when there is nothing else to do

Every candidate is answered once. The newest is decided first. The others are answered before their deadline passes, and
of more than `gate.queue` the oldest are rejected. Obstacles, the robot's state, executed transitions and commands take
effect as they arrive.

The robot's state, its transitions and its events are each the stream of one sender (lcmtypes/sole_sender.h). With two
senders of its state nothing is certified and no withdrawal is answered, and with two of the others these do not count.
What one of them reports as wrong counts from either. A plan that one of two executes, or the one before that fell
silent, stays in force for as long as it may run. Of two robots, the silence of one is no fault, and that one has
finished says nothing of the other. With `gate.arming: none` a robot that was heard counts for gate.robot_timeout_ms.

When obstacles, the task or the truth of the declaration change, the certified plans that may be executed are judged
again before any waiting candidate. What no longer holds of them is sent on bus.channels.withdrawn until the robot
answers.

A fault is handed to the kernel, sent on bus.channels.fault, then written to the disk. It is sent again with every
heartbeat, and every candidate is rejected, until a person sends a reset that is later than the fault. A candidate under
a declaration that is known to be false is answered ABSTAIN_FALSIFIED; a reset does not change that.

A certifier that is not in charge sends its heartbeat only, and learns nothing: one that takes charge knows as much as
one that has just been started.

With gate.mode: shadow it decides, reports and learns, and certifies nothing: there is no certificate that a guard could
take, now or later. It sends no fault either, unless a plan that it certified before a reload is in force. It stands by
as soon as a certifier that certifies is heard (charge.h).

The certified plan, for which the robot waits, is sent before the decision: a planner that receives the decision knows
that the plan was handed to the bus before. */
#pragma once

#include <future>
#include <memory>
#include <optional>
#include <string>

#include "bus/node.h"
#include "certifier/gate/charge.h"
#include "certifier/gate/gate.h"
#include "certifier/gate/plan_ledger.h"
#include "certifier/gate/watch.h"
#include "certifier/process/advice_giver.h"
#include "certifier/process/candidate_queue.h"
#include "certifier/process/contradictions.h"
#include "certifier/process/fault_latch.h"
#include "certifier/process/latch_file.h"
#include "certifier/process/status_reporter.h"
#include "certifier/process/task_reload.h"
#include "forereach/certifier_status_t.hpp"
#include "forereach/command_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/sole_sender.h"

namespace forereach {

/** A wall clock and a monotonic clock, both in microseconds. A simulation gives the same for both. */
struct Clocks {
  Clock wall = WallClockUs;
  Clock steady = SteadyClockUs;
};

struct FoundFault;

class CertifierNode final : public Node {
 public:
  static constexpr std::int64_t kHeartbeatUs = StatusReporter::kPeriodUs;
  static constexpr std::size_t kHeldAtMost = 4096;  ///< Candidates that wait while it listens for others.
  static constexpr int kAtOnce = 8;                 ///< Candidates decided on before the bus is looked at again.

  /** @param listen_us how long it listens for another certifier before it takes charge; Charge::kListenUs on a bus that
  others can be on. @param latch may be null: then a restart forgets a fault.
  @throws ConfigError as RequireForCertifyingOnBus. */
  CertifierNode(const Config& config, Bus& bus, Clocks clocks = {}, std::int64_t listen_us = 0,
                std::unique_ptr<LatchFile> latch = nullptr);
  ~CertifierNode() override;

  void Tick(std::int64_t now_us) override;
  [[nodiscard]] bool busy() const override {
    return (!queue_.empty() || withdraws_more_ || advice_.has_work()) && is_in_charge();
  }
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
  void Heed(const certifier_status_t& status);
  void OnFault(const Received& received);
  void LookAtCharge();
  void FollowCharge(Charge::State before);
  void TakeCharge();
  void StandBy();
  void LeaveWaiting();
  [[nodiscard]] std::string WhyNotInCharge() const;
  void LookForObstacles(std::int64_t now_us);
  void LookAtStamps() { watch_.SeeStamps(robot_arrival_, gate_->obstacles_arrival()); }
  void ForgetRobot();

  void OnObstacles(const Received& received);
  void OnRobotState(const Received& received);
  void LookAtRobot(std::int64_t now_us);
  void SeeWhatRobotExecutes(const robot_state_t& state, bool is_one);
  void ForgetSilentRobot(std::int64_t now_us);
  void OnTransition(const Received& received);
  void OnEvent(const Received& received);
  void OnCommand(const Received& received);
  void Obey(const command_t& command, std::int64_t now_us);

  void WithdrawPlans(std::int64_t now_us);
  void AnswerWaiting();
  void AnswerDue();
  [[nodiscard]] GateAnswer Decide(Bytes candidate);
  void Answer(Bytes candidate, bool displaced);
  void GiveAdvice();
  void KeepWarm();
  void CompactIfDue();
  void TakeReload();
  /** Latches and announces, unless a fault as grave is latched already. */
  void Fail(const FoundFault& found);
  void Announce(fault_t fault, const Watch::Fault& latched);
  void SendFault();
  void Learn(Bytes transition);

  void Refuse(const std::string& channel, const std::string& why);

  void Heartbeat(std::int64_t now_us);

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
  PlanLedger plans_;
  bool withdraws_more_ = false;              // than one tick sends
  SoleSender robot_, transitions_, events_;  // who sends the robot's three streams

  CandidateQueue queue_;
  AdviceGiver advice_;
  robot_state_t last_state_{};
  std::optional<Arrival> robot_arrival_;  // of the last state
  transition_t last_transition_{};

  TaskReload reload_;
  std::future<void> compaction_;  // of *gate_
  Contradictions contradictions_;
  FaultLatch latch_;
  StatusReporter reporter_;
  std::int64_t next_warning_us_ = 0, next_warm_us_ = 0;  // by the steady clock
  bool warms_ = true;  // the last certificate is repeated fast enough, as far as is known
};

}  // namespace forereach
