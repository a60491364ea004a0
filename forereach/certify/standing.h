/** What stands of a certified plan after something has changed. */
#pragma once

#include <span>

#include "forereach/certify/certifier.h"

namespace forereach {

/** Which controls of a certified plan stand: 0 .. steps - 1. */
struct Standing {
  int steps = 0;
  /** A certificate: all stand. Otherwise why not. Outcome kNone: the plan could not be judged. */
  Decision verdict = {};
};

/** Judges a plan that was certified before, under the certifier's problem and among these obstacles. The controls that
stand are those whose motions are all proven safe, from sample `first_step` on; earlier ones are past. They are found
from the first failure, at step t:
- D: X_t is proven, but no step from it. Control t does not stand: t controls stand. If only the end of the plan is not
at rest (kNoStop), all its controls stand, and no hold after them is certified.
- S with Problem::between: the motion under control t may touch: t controls stand.
- S at the samples, or by a limit: X_t may touch or exceed it, and control t - 1 leads there: t - 1 controls stand, and
none for t = 0.
- F: the declaration is false: none stands.
If D and S both fail, the fewer. The tube is computed again from X_0, with all observations so far.
@param first_step 0..num_steps. @pre Certifier::Require passes. Cost as Certify's. */
[[nodiscard]] Standing JudgeAgain(const Certifier& certifier, const Plan& plan, const Zonotope& initial_set,
                                  const ObstacleView& obstacles, Tube& tube, int first_step) noexcept;

}  // namespace forereach
