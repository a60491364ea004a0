/** What a record claims of each slice, held against a tube of the verifier's own. */
#pragma once

#include <optional>

#include "verifier/answer.h"
#include "verifier/tube.h"
#include "verifier/verifier.h"

namespace forereach::verifier {

/** The first claim that does not hold, in the order of steps:
- the recorded hull, and the set that the recorded generators span, contain X_t, and no generator reaches beyond the
hull;
- the recorded envelope and remainder contain the derived ones, the envelope is not empty, the radius is no smaller;
- X_t keeps clear of every obstacle, by at least the recorded clearance;
- X_T stands by the problem's `rest`, and so does what was recorded of it.
@pre the tube is whole and sizes agree. */
[[nodiscard]] std::optional<Failure> FindFalseClaim(const Problem& problem, const Certificate& certificate,
                                                    const Tube& tube);

}  // namespace forereach::verifier
