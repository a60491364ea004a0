/** What a robot does besides the guard's checks: it follows certified plans from boundary to boundary, stops, obeys
faults and commands, and reports all of it on the bus.

You implement Supervisor::Robot (state, hold, send, reload), pass it the bytes of four channels as they arrive, and
call Boundary at every step boundary:

    PLAN_CERTIFIED -> OnCertified     ACCEPTED, or REFUSED with the guard's cause
    PLAN_WITHDRAWN -> OnWithdrawn     WITHDRAWN, which answers the certifier; EMERGENCY_STOP if the control that is
                                      being applied stands no longer
    FAULT          -> OnFault         HALTED, an emergency stop, for a fault that invalidates certificates
    COMMAND        -> OnCommand       RESET releases a halted robot; RELOAD calls Robot::Reload

Boundary does, in this order:
 1. FinishStep: if a plan is executing, sends the step that has ended as transition_t and checks the measured state
    against the certified slice: STEP_INSIDE, STEP_CONSISTENT, or STEP_OUTSIDE if it was left, an emergency stop. A step
    that is further off its schedule than the plan's step_error_us is OFF_SCHEDULE, an emergency stop that needs no
    reset, wherever the robot is: no slice is about that time. No transition_t is sent for it: it did not last as long
    as the model's step, so it is no observation of that. Nor is one sent if the state at one of its ends was measured
    with a larger error than the plan's, or with one of its own while a plan of a task that Expect was told of is
awaited;
 2. a pending plan whose start_utime is this boundary takes over, in the middle of a plan or at rest: STARTED. If a
check of the guard fails it is REFUSED, and the current plan goes on;
 3. otherwise the current plan goes on: TAIL_BEGUN where its braking tail begins, STANDING where it ends, with a hold;
 4. robot_state_t reports what is applied from this boundary on.
So without a newer certificate the robot runs the tail that is certified already, holds at rest, and can start from
there.

A plan of which the certifier has withdrawn a part goes on within the controls that stand. A newer plan may take over
until then. If none is pending that starts in time, EMERGENCY_STOP is made: a hold that no certificate covers, though
what stands is used for it. It begins at the last boundary from which the robot provably comes to rest within the
controls that stand: if the next slice, which contains the next state, allows it (Robot::StepsToRest), the robot goes on
for another step. If the time is too short already when the withdrawal arrives, the stop begins at once. The robot is
not halted by it.

After STEP_OUTSIDE and HALTED no plan is accepted until a reset arrives whose stamp is later than everything that
halted the robot. A fault whose stamp is not later than the last reset is a repetition and is ignored. A plan that is
executing is not affected by Expect.

**Exceptions.** No exception leaves this class, except from the constructor and Expect.

- A call decides first and sets the control or holds. It calls Robot::Send last. If Send throws anything, nothing else
  changes: the report is counted, and sent again in the next calls, in the order of its channel. At most 64 reports of
  a channel wait; then the oldest is lost. A report keeps its sequence number, so receivers see a gap for each lost
  one. A report that was sent before Send threw arrives twice, with the same sequence number and time.
- If anything else throws (state, Hold, StepsToRest, Reload, an allocation), the plan ends and the robot holds:
  ERROR_STOP. The robot is not halted, and the next plan starts as any other. If Hold throws, each later call calls it
  again, and no plan starts until it returns.
- A fault halts the robot before anything can throw. If the state cannot be measured then, HALTED has the one that was
  measured last, and ERROR_STOP follows it.
- A boundary whose state could not be measured sends no robot_state_t, and leaves out its sequence number.
- Boundary checks state and time again if FinishStep was called before it. So a control is returned only if the guard
  has checked the state and the time of that call, whatever was called or threw before. The time is checked unless the
  plan's step_error_us is -1.
- If your program throws between the calls (a clock, a receiver), this object does not know it: hold until Boundary
  returns a control.

The functions of Robot may call Report and Expect, and Send also what takes messages, as if after the call that sends.
If one of them calls anything else, this does nothing, and the robot holds as after an exception.

With keys, messages count only if the certifier signed the plan, withdrawal or fault, and the operator the command; and
if they were signed since this robot's start and not ahead of its clock (bus/authentic.h): a fault recorded earlier
halts no robot. A withdrawal or a fault counts up to kStopsAheadUs ahead. The start is the first message of each of the
two, guard and supervisor. What is refused is REFUSED. Messages that this class sends are not signed: sign them with
bus/authentic.h's Signer, or with a bus that does.

No clock, no bus, no thread, not thread-safe. It needs the guard and the message types only. All times are microseconds
since the Unix epoch. */
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bus/authentic.h"
#include "forereach/command_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/fault_t.hpp"
#include "lcmtypes/codec.h"
#include "robot/guard.h"
#include "robot/report_queue.h"

namespace forereach {

struct SupervisorOptions {
  GuardOptions guard;
  std::int64_t max_age_us = 500'000;                 ///< The task's gate.max_age_ms: an older command is refused.
  std::int64_t max_ahead_us = 50'000;                ///< The task's gate.max_ahead_ms: so is one from further ahead.
  std::string fault = "FAULT", command = "COMMAND";  ///< Channels, as the guard's `channel`: they are signed.
  std::string robot_state = "ROBOT_STATE", transition = "TRANSITION", event = "EXECUTION_EVENT";
};

class Supervisor final {
 public:
  /** The supervised robot. It is called only from within a call of the supervisor. */
  class Robot {
   public:
    virtual ~Robot() = default;
    /** The state that was measured last: num_states entries. */
    [[nodiscard]] virtual std::span<const double> state() const = 0;
    /** How far the true state may be from state(), num_states entries, not negative: of an estimator, a stated multiple
    of its standard deviations. Empty: as far as the plan's state_error says. */
    [[nodiscard]] virtual std::span<const double> state_error() const { return {}; }
    /** Come to rest by your own means, and hold until Boundary returns a control. In an emergency nothing certified is
    left to execute, whatever the speed is. */
    virtual void Hold() = 0;
    /** An upper bound on the steps that Hold takes from a step boundary to rest, from any state x with lower <= x <=
    upper, num_states entries each (robot/brake.h computes such bounds). The default is
    Brake::kNoEnd, none is known: an emergency stop for a withdrawal begins as soon as the withdrawal is known. */
    [[nodiscard]] virtual int StepsToRest(std::span<const double> lower, std::span<const double> upper) const;
    /** Sends a report. It must not wait. If it throws, the report is sent again later. */
    virtual void Send(const std::string& channel, Bytes message) = 0;
    /** A person asks for the task to be read again; call Expect once that is done. */
    virtual void Reload() = 0;
  };

  struct Counts {
    std::int64_t boundaries = 0, steps = 0, steps_inside = 0, steps_consistent = 0, accepted = 0, started = 0,
                 emergency_stops = 0;
    std::int64_t errors = 0;                      ///< ERROR_STOPs.
    std::int64_t failed_sends = 0;                ///< Calls of Robot::Send that threw.
    std::int64_t reports_lost = 0;                ///< Reports that will not be sent again, as too many waited.
    std::map<std::string, std::int64_t> refused;  ///< By GuardCauseName.
  };

  /** @param robot outlives this object. @throws std::invalid_argument as the guard does. */
  Supervisor(SupervisorOptions options, Robot& robot);

  /** A message of its channel, as it came, trailer included, and when. */
  void OnCertified(Bytes message, std::int64_t now_us) noexcept;
  void OnWithdrawn(Bytes message, std::int64_t now_us) noexcept;
  void OnFault(Bytes message, std::int64_t now_us) noexcept;
  /** @return why the command is refused, in words; empty if it is obeyed or not for robots. */
  std::string OnCommand(Bytes message, std::int64_t now_us) noexcept;

  /** Handles a step boundary. @param utime the boundary's time. @param now_us later than that if the robot was held up;
  a plan that has expired meanwhile is refused, and the plan under way ends where now_us is too late for its
  step_error_us. @param ends the robot ends its run: no further plan starts, and at rest it reports FINISHED.
  @return the control to apply until the next boundary, num_inputs entries, valid until the next call of this object;
  empty: hold. */
  std::span<const double> Boundary(std::int64_t utime, std::int64_t now_us, bool ends = false) noexcept;
  /** The first part of Boundary, which then only checks again: for a robot that reports events of its own in between.
   */
  void FinishStep(std::int64_t utime, std::int64_t now_us) noexcept;

  /** Guard::Expect. */
  void Expect(const Digest& config_digest, const Digest& model_digest, std::optional<GuardDomain> domain = {},
              const std::optional<std::vector<int>>& angles = {});

  /** Sends an event. @param text one sentence. */
  void Report(std::int64_t utime, std::int16_t kind, double value, std::string_view text) noexcept;

  /** The control that Boundary has returned, until FinishStep, a stop or a withdrawal ends it; empty: hold. */
  [[nodiscard]] std::span<const double> control() const {
    return is_under_way_ ? guard_.control() : std::span<const double>();
  }
  [[nodiscard]] bool halted() const { return guard_.halted(); }
  [[nodiscard]] const Counts& counts() const { return counts_; }
  /** The number of reports that wait to be sent again. */
  [[nodiscard]] std::size_t reports_waiting() const { return reports_.waiting(); }

 private:
  template <class Work>
  void Run(std::int64_t utime, const Work& work) noexcept;
  void StopAfterException(std::int64_t utime) noexcept;
  [[nodiscard]] bool IsMisuse(bool may_be_sending) noexcept;
  void Measure();
  [[nodiscard]] GuardVerdict Authenticated(const std::string& channel, const Speaker& speaker, Bytes& message,
                                           std::int64_t now_us);
  [[nodiscard]] bool IsExecuting() const { return guard_.executing() != nullptr; }
  [[nodiscard]] std::int64_t PlanId() const;
  [[nodiscard]] int Step() const { return IsExecuting() ? step_ : -1; }
  void TakeFault(Bytes message, std::int64_t now_us);
  [[nodiscard]] std::string Obey(Bytes message, std::int64_t now_us);
  void CheckStep(std::int64_t utime, std::int64_t now_us);
  void StartPending(std::int64_t utime, std::int64_t now_us);
  void ContinuePlan(std::int64_t utime);
  [[nodiscard]] bool MustStop() const;
  [[nodiscard]] bool TakesOver(int standing) const;
  void StopInEmergency(std::int64_t utime);
  void Hold();
  void HoldIfMoving();
  void ReportState(std::int64_t utime, bool ends) noexcept;
  void ReportTransition(std::int64_t utime, std::int64_t duration_us) noexcept;
  void ReportRefusal(std::int64_t utime, const GuardVerdict& verdict);
  void ReportEvent(std::int64_t utime, std::int16_t kind, std::int64_t plan_id, int step, double value,
                   std::string_view text, int coordinate = -1) noexcept;
  void SendReports(std::int64_t utime) noexcept;

  const SupervisorOptions options_;
  Robot& robot_;
  Guard guard_;
  std::optional<Authenticator> authenticator_;       // of faults and commands
  std::int64_t halted_utime_ = 0, reset_utime_ = 0;  // the last time: by a fault or the guard; by a person
  int step_ = 0;                                     // of the executing plan: the control that applies now
  bool is_under_way_ = false;                        // Boundary has returned that control, its step is not finished
  bool is_holding_ = true;                           // Hold has returned since the last control
  std::int64_t step_utime_ = 0;                      // the boundary from which that control applies
  std::vector<double> step_began_at_;                // the state
  std::int64_t step_began_us_ = 0;                   // by the robot's clock
  std::vector<double> step_began_within_;            // its error
  std::vector<double> state_, state_error_;          // measured last
  bool is_measured_ = false;                         // in this call
  bool is_deciding_ = false, is_sending_ = false;    // a call is under way
  bool is_misused_ = false;                          // a function of the robot called what it may not
  std::int64_t events_ = 0;
  ReportQueue reports_;
  Counts counts_;
};

}  // namespace forereach
