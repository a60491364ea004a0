/** Transitions in which a state in rad jumps by a turn, though the model does not know that it is an angle. */
#pragma once

#include <optional>
#include <string>

#include "forereach/dynamics/model.h"
#include "forereach/residual/transitions.h"
#include "task/config_error.h"

namespace forereach {

struct WrappedAngle {
  int row = 0;  ///< Of the transitions.
  /** "th differs from the model's next value by 6.283 rad, about one turn, and model.angles does not name it". */
  std::string what;
  std::string advice;  ///< What to write.
};

/** The first transition that differs from f0 by a whole turn, up to an eighth, in a state whose unit is rad and which
is no angle of the model's. Nothing unless most of the transitions differ by less than an eighth of a turn there. */
[[nodiscard]] std::optional<WrappedAngle> FindWrappedAngle(const NominalModel& model, const Transitions& transitions);

/** @param config, path of the task file and of the transitions. @throws ConfigError if there is one: what is estimated
from such transitions is wrong. */
void RequireNoWrappedAngle(const std::string& config, const std::string& path, const NominalModel& model,
                           const Transitions& transitions);

}  // namespace forereach
