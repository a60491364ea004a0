/** Whether anything may be certified at all: a state machine over what is heard of the world. No bus, no clock in it.

    disarmed --SeeRobot--> armed --RobotHasFinished--> disarmed
    any state --Latch, or what Advance notices--> fault --Reset--> disarmed

Only a person clears a fault: what made it is looked at first. The first fault is kept, unless a later one stops the robot
and it does not: then the later one takes its place. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace forereach {

struct WatchOptions {
  bool needs_robot_state = true;  ///< Else it is armed without.
  std::int64_t robot_timeout_us = 0, max_clock_jump_us = 0;
};

class Watch final {
 public:
  enum class State { kDisarmed = 1, kArmed = 2, kFault = 3 };  // certifier_status_v3_t's numbers
  struct Fault {
    std::int16_t cause;  ///< fault_t's
    std::int64_t utime;
    std::string why;
  };

  explicit Watch(const WatchOptions& options) : options_(options) {}

  /** From here on by these. What was seen, and a fault, stay. */
  void Follow(const WatchOptions& options) { options_ = options; }

  /** A usable state of the robot has been heard. */
  void SeeRobot(std::int64_t now_us);
  /** The robot has said that it ends: its silence is no fault. */
  void RobotHasFinished();

  /** Time has passed: `now_us` by the wall clock, `steady_us` by one that nobody sets. Latches ROBOT_STATE_LOST and
  CLOCK_JUMP. @return the fault if this call latched it. */
  std::optional<Fault> Advance(std::int64_t now_us, std::int64_t steady_us);

  /** @return true if it is the one that is latched now. */
  bool Latch(Fault fault);
  /** Clears a fault. True if there was one. */
  bool Reset();

  [[nodiscard]] State state() const;
  [[nodiscard]] const std::optional<Fault>& fault() const { return fault_; }

 private:
  WatchOptions options_;
  std::optional<Fault> fault_;
  std::optional<std::int64_t> robot_seen_us_;
  std::optional<std::int64_t> offset_us_;  // of the wall clock from the steady one, at the last call
};

}  // namespace forereach
