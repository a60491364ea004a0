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
    against the certified slice: STEP_INSIDE, or STEP_OUTSIDE, an emergency stop. A step that is further off its
    schedule than the guard's max_jitter_us is OFF_SCHEDULE, an emergency stop that needs no reset;
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

After every other emergency stop no plan is accepted until a reset arrives whose stamp is later than everything that
halted the robot. A fault whose stamp is not later than the last reset is a repetition and is ignored. A plan that is
executing is not affected by Expect.

With keys, messages count only if the certifier signed the plan, withdrawal or fault, and the operator the command; and
if they were signed since this robot's start and not ahead of its clock (bus/authentic.h): a fault recorded earlier
halts no robot. The start is the first message of each of the two, guard and supervisor. What is refused is REFUSED.
Messages that this class sends are not signed: sign them with bus/authentic.h's Signer, or with a bus that does.

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
    /** Come to rest by your own means, and hold until Boundary returns a control. In an emergency nothing certified is
    left to execute, whatever the speed is. */
    virtual void Hold() = 0;
    /** An upper bound on the steps that Hold takes from a step boundary to rest, from any state x with lower <= x <=
    upper, num_states entries each (robot/brake.h computes such bounds). The default is
    Brake::kNoEnd, none is known: an emergency stop for a withdrawal begins as soon as the withdrawal is known. */
    [[nodiscard]] virtual int StepsToRest(std::span<const double> lower, std::span<const double> upper) const;
    virtual void Send(const std::string& channel, Bytes message) = 0;
    /** A person asks for the task to be read again; call Expect once that is done. */
    virtual void Reload() = 0;
  };

  struct Counts {
    std::int64_t boundaries = 0, steps = 0, steps_inside = 0, accepted = 0, started = 0, emergency_stops = 0;
    std::map<std::string, std::int64_t> refused;  ///< By GuardCauseName.
  };

  /** @param robot outlives this object. @throws std::invalid_argument as the guard does. */
  Supervisor(SupervisorOptions options, Robot& robot);

  /** A message of its channel, as it came, trailer included, and when. */
  void OnCertified(Bytes message, std::int64_t now_us);
  void OnWithdrawn(Bytes message, std::int64_t now_us);
  void OnFault(Bytes message, std::int64_t now_us);
  /** @return why the command is refused, in words; empty if it is obeyed or not for robots. */
  std::string OnCommand(Bytes message, std::int64_t now_us);

  /** Handles a step boundary. @param utime the boundary's time. @param now_us later than that if the robot was held up;
  a plan that has expired meanwhile is refused, and with the guard's max_jitter_us the plan under way ends where now_us
  is too late. @param ends the robot ends its run: no further plan starts, and at rest it reports FINISHED.
  @return the control to apply until the next boundary, num_inputs entries, valid until the next call of this object;
  empty: hold. */
  std::span<const double> Boundary(std::int64_t utime, std::int64_t now_us, bool ends = false);
  /** The first part of Boundary, which then leaves it out: for a robot that reports events of its own in between. */
  void FinishStep(std::int64_t utime, std::int64_t now_us);

  /** Guard::Expect. */
  void Expect(const Digest& config_digest, const Digest& model_digest, std::optional<GuardDomain> domain = {},
              const std::optional<std::vector<int>>& angles = {});

  /** Sends an event. @param text one sentence. */
  void Report(std::int64_t utime, std::int16_t kind, double value, std::string_view text);

  /** The control that applies now; empty: hold. */
  [[nodiscard]] std::span<const double> control() const { return guard_.control(); }
  [[nodiscard]] bool halted() const { return guard_.halted(); }
  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  [[nodiscard]] GuardVerdict Authenticated(const std::string& channel, std::string_view speaker, Bytes& message,
                                           std::int64_t now_us);
  [[nodiscard]] bool IsExecuting() const { return guard_.executing() != nullptr; }
  [[nodiscard]] std::int64_t PlanId() const;
  [[nodiscard]] int Step() const { return IsExecuting() ? step_ : -1; }
  void StartPending(std::int64_t utime, std::int64_t now_us);
  void ContinuePlan(std::int64_t utime);
  [[nodiscard]] bool MustStop() const;
  [[nodiscard]] bool TakesOver(int standing) const;
  void StopInEmergency(std::int64_t utime);
  void Hold();
  void SendState(std::int64_t utime, bool ends);
  void SendTransition(std::int64_t utime);
  void SendRefusal(std::int64_t utime, const GuardVerdict& verdict);
  void SendEvent(std::int64_t utime, std::int16_t kind, std::int64_t plan_id, int step, double value,
                 std::string_view text, int coordinate = -1);
  template <class Message>
  void Send(const std::string& channel, const Message& message) {
    robot_.Send(channel, Bytes(Encode(message)));
  }

  const SupervisorOptions options_;
  Robot& robot_;
  Guard guard_;
  std::optional<Authenticator> authenticator_;       // of faults and commands
  std::int64_t halted_utime_ = 0, reset_utime_ = 0;  // the last time: by a fault or the guard; by a person
  int step_ = 0;                                     // of the executing plan: the control that applies now
  bool is_under_way_ = false;                        // that control's step has not been finished
  std::int64_t step_utime_ = 0;                      // the boundary from which that control applies
  std::vector<double> step_began_at_;                // the state
  std::int64_t events_ = 0;
  Counts counts_;
};

}  // namespace forereach
