/** What stamps and arrivals of messages say about the clock of their sender.

A certificate among obstacles that move says where robot and obstacles are at one time. The robot's states and the
obstacles are stamped by two clocks, and the certifier can compare both with its own: with s the stamp of a message and
a its arrival, both microseconds since the Unix epoch, E gate.max_clock_error_ms and D bus.delay_ms, a sender that keeps
what the task declares has

    -E <= a - s <= E + D                                     of each message
    abs((a - s of the robot) - (a - s of the obstacles)) <= E + D

because a message takes 0 to D, and only that. Nothing is learned: a clock that is behind from the start would teach its
error. What keeps both lines may still be off by up to D more than E, because a late message and a clock that is behind
look the same.

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
  std::int64_t error_us, delay_us;  ///< E and D above, not negative.
};

/** The bounds of a task. Nothing without gate.max_clock_error_ms: then nothing moves, and no certificate rests on when
a step is taken. */
[[nodiscard]] std::optional<ClockBounds> ClockBoundsOf(const Config& config);

/** How the first line above is broken: "behind, or its messages are late: the last one arrived 473 ms after its stamp,
at most 70 ms are allowed"; empty if it is not. For any stamp. */
[[nodiscard]] std::string WhyOff(const Arrival& arrival, const ClockBounds& bounds);

/** How the second line is broken; empty if it is not. @pre WhyOff is empty for both. */
[[nodiscard]] std::string WhyApart(const Arrival& robot, const Arrival& obstacles, const ClockBounds& bounds);

}  // namespace forereach
