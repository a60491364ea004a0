/** What stamps and arrivals of messages say about the clock of their sender.

A certificate among obstacles that move says where robot and obstacles are at one time. The robot's states and the
obstacles are stamped by two clocks, and the certifier can compare both with its own: with s the stamp of a message and
a its arrival, both microseconds since the Unix epoch, E gate.max_clock_error_ms, D bus.delay_ms and S
robot.step_error_ms, or 0 where that is not given because E counts for steps, too (ScheduleErrorUs), a sender that keeps
what the task declares has

    -E <= a - s <= E + D                                     of each message of obstacles
    -E - S <= a - s <= E + S + D                             of each state of the robot
    abs((a - s of the robot) - (a - s of the obstacles)) <= E + S + D

because a message takes 0 to D, and only that, and the stamp of a state is when its boundary is due. Nothing is learned:
a clock that is behind from the start would teach its error. What keeps these lines may still be off by up to D more
than E, a robot by S more, because a late message and a clock that is behind look the same.

No clock, no bus. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "task/config.h"

namespace forereach {

/** A message by its stamp and its arrival, microseconds since the Unix epoch, the latter by this process's clock. */
struct Arrival {
  std::int64_t utime, at_us;
  friend bool operator==(const Arrival&, const Arrival&) = default;
};

struct ClockBounds {
  std::int64_t error_us, delay_us, step_us = 0;  ///< E, D and S above, not negative.

  /** Those of the first line with S in E, for the second one. */
  [[nodiscard]] ClockBounds OfRobot() const { return {error_us + step_us, delay_us}; }
};

/** The bounds of a task. Nothing without gate.max_clock_error_ms: then nothing moves, and no certificate rests on when
a step is taken. */
[[nodiscard]] std::optional<ClockBounds> ClockBoundsOf(const Config& config);

/** How the first line above is broken, or with OfRobot the second: "behind, or its messages are late: the last one
arrived 473 ms after its stamp, at most 70 ms are allowed"; empty if it is not. For any stamp. */
[[nodiscard]] std::string WhyOff(const Arrival& arrival, const ClockBounds& bounds);

/** How the third line is broken; empty if it is not. @pre WhyOff is empty for both. */
[[nodiscard]] std::string WhyApart(const Arrival& robot, const Arrival& obstacles, const ClockBounds& bounds);

}  // namespace forereach
