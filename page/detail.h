/** What a page shows of one decision: found by certifying its candidate again. */
#pragma once

#include <string>

#include "forereach/certify/certifier.h"
#include "page/page_data.h"
#include "records/certifier_follower.h"
#include "task/config.h"

namespace forereach {

/** Why a candidate cannot be judged again under this task; empty if it can, as far as Certifier::Require agrees. */
[[nodiscard]] std::string WhyNotJudged(const candidate_plan_t& candidate, const Config& task);

/** Fills in what the second decision on a candidate found, or why there is no tube: also if it differs from the first.
@param tube of `again`, which `certifier` has made. */
void Describe(const Certifier& certifier, const JudgedCandidate& judged, const Decision& again, const Tube& tube,
              PageDetail& detail);

}  // namespace forereach
