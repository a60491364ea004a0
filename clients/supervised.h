/** What a task says of the robot that executes its plans, for a Supervisor. */
#pragma once

#include "robot/supervisor.h"
#include "task/config.h"

namespace forereach {

/** The options of a Supervisor that accepts the plans certified under this task and no others, with its channels and
the keys of the role robot. @throws KeyError, BusError. */
[[nodiscard]] SupervisorOptions SupervisorOptionsOf(const Config& config);

/** Supervisor::Expect, after the task was read again. @throws std::invalid_argument as it does. */
void ExpectTask(const Config& config, Supervisor& supervisor);

}  // namespace forereach
