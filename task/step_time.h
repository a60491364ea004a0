/** How long a step of a plan may last, by the options of a task. */
#pragma once

#include <cstdint>
#include <optional>

#include "task/config.h"

namespace forereach {

/** How far a step of a plan may be from its time, and how much longer than step_us it may last, on the robot's own
clock, in microseconds: half of gate.max_clock_error_ms. The guard stops a plan at a step that is further off. Nothing:
no clock is looked at. */
[[nodiscard]] std::optional<std::int64_t> MaxJitterUs(const GateOptions& options);

/** The longest time from one sample of a plan to the next, seconds, from above: model.dt, and what a step may last
longer (MaxJitterUs). task.between bounds the motion in this time. */
[[nodiscard]] double LongestPeriod(const Config& config);

}  // namespace forereach
