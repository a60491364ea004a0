/** Checks the claims of a record about each slice against the verifier's own tube. */
#pragma once

#include <optional>

#include "verifier/answer.h"
#include "verifier/functions.h"
#include "verifier/tube.h"
#include "verifier/verifier.h"

namespace forereach::verifier {

/** The first false or undecided claim, in the order of steps. Nothing if all hold. With X_t the derived slices, the
claims are:
- the recorded hull contains X_t; the set of the recorded generators contains X_t and lies in the recorded hull;
- the recorded envelope and remainder contain the derived ones, the envelope is not empty, and the radius is no smaller;
- X_t is disjoint from every obstacle, with at least the recorded clearance;
- what the body sweeps meets no side of an area to stay in, and one of its points lies inside;
- X_t keeps the problem's limits;
- the heading can turn from the recorded hull of X_t to that of X_{t+1} within the declared turn rate;
- X_T satisfies the problem's `rest`, and so does the recorded last slice.
@param functions those of the problem. @pre the tube is complete and sizes agree. */
[[nodiscard]] std::optional<Failure> FindFalseClaim(const Problem& problem, const Certificate& certificate,
                                                    const TaskFunctions& functions, const Tube& tube);

}  // namespace forereach::verifier
