/** Decisions in words. */
#pragma once

#include <string>

#include "certifier/certify/decision.h"
#include "certifier/certify/problem.h"

namespace forereach {

/** One sentence for a person: outcome, step, cause and witness by name, with values, bounds and units. */
[[nodiscard]] std::string Explain(const Decision& decision, const Problem& problem);

}  // namespace forereach
