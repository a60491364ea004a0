/** Whether anything may be certified at all: a state machine over what is known of the world. No bus, no clock in it.

    disarmed --all needs are met--> armed --one is lacking--> disarmed
    any state --Latch, or what Advance notices--> fault --Reset--> disarmed

Only a person clears a fault, after a look at what made it. The first fault is kept; a later one takes its place only if
it stops the robot and the first does not. */
#pragma once

#include <array>
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
  /** What has to hold before anything is certified. Of several that are lacking the first gives the cause. To add one:
  an entry here, its cause in watch.cpp. */
  enum class Need { kCharge, kLatch, kRobotState, kObstacles };
  static constexpr std::size_t kNeeds = 4;
  struct Refusal {
    std::int16_t cause;  ///< decision_t's
    std::string why;     ///< Names everything that is lacking.
  };

  explicit Watch(const WatchOptions& options);

  /** From here on by these. What was seen, and a fault, stay. */
  void Follow(const WatchOptions& options);

  /** @param why_not a clause that says why the need is not met; empty: it is met. Every need but the robot's state is
  met at first, and the robot's state is this class's own affair. */
  void Set(Need need, std::string why_not);

  /** What Set has said of it. */
  [[nodiscard]] const std::string& Lacks(Need need) const { return lacking_[static_cast<std::size_t>(need)]; }

  /** A usable state of the robot has been heard. */
  void SeeRobot(std::int64_t now_us);
  /** The robot has said that it ends, or what was heard of it counts no more: its silence is no fault. */
  void RobotHasFinished();

  /** Time has passed: `now_us` by the wall clock, `steady_us` by one that nobody sets. Latches ROBOT_STATE_LOST and
  CLOCK_JUMP. @return the fault if this call latched it. */
  std::optional<Fault> Advance(std::int64_t now_us, std::int64_t steady_us);

  /** @return true if it is the one that is latched now. */
  bool Latch(Fault fault);
  /** Clears a fault. True if there was one. */
  bool Reset();

  [[nodiscard]] State state() const;
  /** Why nothing may be certified now; nothing if it is armed. */
  [[nodiscard]] std::optional<Refusal> WhyNot() const;
  [[nodiscard]] const std::optional<Fault>& fault() const { return fault_; }

 private:
  void LookForRobot();

  WatchOptions options_;
  std::optional<Fault> fault_;
  std::array<std::string, kNeeds> lacking_;  // why, by Need
  std::optional<std::int64_t> robot_seen_us_;
  std::optional<std::int64_t> offset_us_;  // of the wall clock from the steady one, at the last call
};

}  // namespace forereach
