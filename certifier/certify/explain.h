/** Decisions as sentences. */
#pragma once

#include <string>

#include "certifier/certify/decision.h"
#include "certifier/certify/problem.h"

namespace forereach {

/** One sentence with outcome, step, cause and witness by name, with values, bounds and units. Numbers have six digits
and are rounded so that the sentence stays true: a clearance down, a depth up. */
[[nodiscard]] std::string Explain(const Decision& decision, const Problem& problem);

/** The sentence for a certificate, without kCapped. @param obstacle index of the closest obstacle, -1 without
obstacles.
@param closest_step step of the closest slice. @param clearance lower bound on their distance, in metres. */
[[nodiscard]] std::string ExplainCertificate(int closest_step, int obstacle, double clearance);

/** Appended to the sentence if Decision::capped. */
inline constexpr const char* kCapped = "; a search met max_leaf_visits";

}  // namespace forereach
