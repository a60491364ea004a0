/** What a page shows of one decision: found by certifying its candidate again. */
#pragma once

#include "forereach/certify/certifier.h"
#include "page/page_data.h"
#include "records/recorded_case.h"

namespace forereach {

/** Fills in what the second decision on a candidate found, or why there is no tube: also if it differs from the first.
@param tube of `again`, which `certifier` has made. */
void Describe(const Certifier& certifier, const JudgedCandidate& judged, const Decision& again, const Tube& tube,
              PageDetail& detail);

}  // namespace forereach
