/** `forereach declare --between`. */
#pragma once

#include <string>

#include "forereach/declare/slope_bound.h"

namespace forereach {

struct BetweenCommand {
  std::string config;
  bool from_positions = false;  ///< Otherwise from the model's equations.
  bool json = false;
  bool rates = false;  ///< Also for model.rate_bound, each confirmed by the verifier. From equations alone.
  SlopeBoundOptions search;
  double seconds = 45;  ///< For all bounds together. What is found by then, or by Ctrl-C, is printed.
};

/** Prints bounds for the key task.between of a task file, and what they rest on.
@return the exit status: 1 if the search stopped before its gap, or a rate is not confirmed. @throws ConfigError,
std::runtime_error. */
[[nodiscard]] int DeclareBetween(const BetweenCommand& command);

}  // namespace forereach
