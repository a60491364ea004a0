/** An executed transition from the bus, as a certifier learns it. */
#pragma once

#include <string>
#include <vector>

#include "certifier/certify/problem.h"
#include "forereach/transition_t.hpp"

namespace forereach {

struct ExecutedTransition {
  std::vector<double> z, next;  ///< (x, u) and x+
  std::string refusal;          ///< What keeps it from being learned. Empty if nothing does.
};

/** Refuses sizes other than the model's. */
[[nodiscard]] ExecutedTransition FromMessage(const transition_t& message, const NominalModel& model);

/** Also refuses transitions that a certifier would not learn (certify/learned.h). For readers of logs, which have no
 * certifier. */
[[nodiscard]] ExecutedTransition FromMessage(const transition_t& message, const Problem& problem);

}  // namespace forereach
