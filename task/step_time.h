/** How far the boundaries of a plan's steps may be off their times, by the options of a task. */
#pragma once

#include <cstdint>
#include <optional>

#include "task/config.h"

namespace forereach {

/** How far a boundary may be from start_utime + t step_us, and from the first step's time + t step_us, on the robot's
own clock, in microseconds: robot.step_error_ms. The guard stops a plan at a step that is further off, or has lasted
longer than step_us by more. Nothing, also for `any`: no clock is looked at. */
[[nodiscard]] std::optional<std::int64_t> StepErrorUs(const GateOptions& options);

/** How far a boundary may be from its time on the clock of the obstacles' stamps, microseconds: what the robot's clock
may be off, and StepErrorUs. */
[[nodiscard]] std::int64_t ScheduleErrorUs(const GateOptions& options);

/** step_us of a plan of this task: model.dt in microseconds, to the nearest. */
[[nodiscard]] std::int64_t StepUs(const Config& config);

/** StepTiming::error, seconds, from above: StepErrorUs, and what 128 steps of step_us differ from 128 of model.dt. 0 if
StepErrorUs is and model.dt is the double of whole microseconds, which then are the step; and if no clock is looked at.
*/
[[nodiscard]] double StepErrorSeconds(const Config& config);

/** The longest time from one sample of a plan to the next, seconds, from above: model.dt, and what a step may last
longer (StepErrorUs). task.between bounds the motion in this time. */
[[nodiscard]] double LongestPeriod(const Config& config);

}  // namespace forereach
