/** Decisions in words. */
#pragma once

#include <string>

#include "certifier/certify/decision.h"
#include "certifier/certify/problem.h"

namespace forereach {

/** One sentence for a person: outcome, step, cause and witness by name, with values, bounds and units.
Numbers have six digits, rounded so that the sentence stays true: a clearance down, a depth up. */
[[nodiscard]] std::string Explain(const Decision& decision, const Problem& problem);

/** The same of a certificate, without kCapped. @param obstacle that the tube comes closest to, at X_closest_step and by
at least `clearance` metres; -1 without obstacles. */
[[nodiscard]] std::string ExplainCertificate(int closest_step, int obstacle, double clearance);

/** Added where Decision::capped. */
inline constexpr const char* kCapped = "; a search met max_leaf_visits";

}  // namespace forereach
