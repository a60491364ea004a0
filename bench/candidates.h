/** The benchmark tasks as the gate and the bus see them. */
#pragma once

#include <cstdint>

#include "bench/tasks.h"
#include "forereach/candidate_plan_t.hpp"
#include "task/config.h"

namespace forereach::bench {

/** A configuration as a task file with this task would give. */
[[nodiscard]] Config MakeConfig(const Task& task);

/** The task's plan as a candidate sent at `now_us`, to start 100 ms later. Its fields beyond time and id do not change,
so one candidate can be stamped again and again. */
[[nodiscard]] candidate_plan_t MakeCandidate(const Task& task);
void Stamp(candidate_plan_t& candidate, std::int64_t plan_id, std::int64_t now_us);

}  // namespace forereach::bench
