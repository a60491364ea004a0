/** A task's part in the grounds of a decision. */
#pragma once

#include "certifier/task/config.h"
#include "lcmtypes/grounds.h"

namespace forereach {

/** The digests of a task before anything is heard or learned. */
[[nodiscard]] inline Grounds GroundsOf(const Config& task) {
  return {task.digest, task.model_digest, task.declaration_digest, task.observations_digest, task.obstacles_digest};
}

}  // namespace forereach
