/** Decides whether the certifier may certify at all. It is a state machine that uses no bus and no clock.

    disarmed --all needs are met--> armed --one need is missing--> disarmed
    any state --Latch, or a fault found by Advance--> fault --Reset--> disarmed

Only an operator clears a fault, after an inspection of its cause. The first fault is kept. A later fault replaces it
only if it stops the robot and the first one does not. */
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "certifier/gate/pauses.h"
#include "certifier/gate/stream_clock.h"

namespace forereach {

struct WatchOptions {
  bool needs_robot_state = true;  ///< False: the robot's state is not needed.
  std::int64_t robot_timeout_us = 0, max_clock_jump_us = 0;
  std::optional<ClockBounds> clocks = {};  ///< Nothing: stamps are not compared with arrivals.
};

class Watch final {
 public:
  enum class State { kDisarmed = 1, kArmed = 2, kFault = 3 };  // certifier_status_t's numbers
  struct Fault {
    std::int16_t cause;  ///< fault_t's
    std::int64_t utime;
    std::string why;
  };
  /** The preconditions of certifying. If several are missing, the first one gives the cause. To add a need, add an
  entry here and its cause in watch.cpp. */
  enum class Need { kCharge, kLatch, kRobotState, kClocks, kObstacles };
  static constexpr std::size_t kNeeds = 5;
  struct Refusal {
    std::int16_t cause, outcome;  ///< decision_t's
    std::string why;              ///< Names everything that is missing.
  };

  explicit Watch(const WatchOptions& options);

  /** Uses new options from now on. Observed state and a latched fault stay. */
  void Follow(const WatchOptions& options);

  /** Sets whether a need is met. @param why_not a clause with the reason why it is not; empty: it is met. All needs are
  met at first, except the robot's state. SeeRobot and Advance maintain that one, SeeStamps kClocks. */
  void Set(Need need, std::string why_not);

  /** The text of the last Set for this need. */
  [[nodiscard]] const std::string& Lacks(Need need) const { return lacking_[static_cast<std::size_t>(need)]; }

  /** Notes a usable state of the robot. @param now_us microseconds since the Unix epoch. */
  void SeeRobot(std::int64_t now_us);
  /** Notes when the newest messages of the streams were stamped and arrived (stream_clock.h). While one of them is
  outside the bounds, kClocks is lacking; the next one decides anew. So one datagram that is late costs the time to the
  next, and a clock that is off certifies nothing. @param robot the last state, also one that is not usable for its
  stamp alone; nothing: none since the robot was forgotten. @param obstacles the last ones taken, if any. */
  void SeeStamps(const std::optional<Arrival>& robot, const std::optional<Arrival>& obstacles);
  /** Notes that the robot has finished, or that its earlier states do not count any more. Its silence is then not a
  fault. */
  void RobotHasFinished();

  /** Notes that the process runs, from which pauses are known. Advance does this, too. */
  void Run(std::int64_t now_us, std::int64_t steady_us) { pauses_.Call(now_us, steady_us); }
  [[nodiscard]] const Pauses& pauses() const { return pauses_; }

  /** Processes the passing of time and latches ROBOT_STATE_LOST and CLOCK_JUMP. @param now_us by the wall clock.
  @param steady_us by a monotonic clock. @return the fault if this call latched it. */
  std::optional<Fault> Advance(std::int64_t now_us, std::int64_t steady_us);

  /** Latches a fault. @return whether this fault is the latched one now. */
  bool Latch(Fault fault);
  /** Clears the latched fault. @return whether there was one. */
  bool Reset();

  [[nodiscard]] State state() const;
  /** The reason why nothing may be certified now. Nothing if it is armed. */
  [[nodiscard]] std::optional<Refusal> WhyNot() const;
  [[nodiscard]] const std::optional<Fault>& fault() const { return fault_; }

 private:
  void LookForRobot();

  WatchOptions options_;
  std::optional<Fault> fault_;
  std::array<std::string, kNeeds> lacking_;  // the reason, by Need
  std::optional<std::int64_t> robot_seen_us_;
  Pauses pauses_;
  std::optional<std::int64_t> offset_us_;  // wall clock minus monotonic clock at the last call
};

}  // namespace forereach
