/** One plan under one method: the certifier's answer and tube with that method's enclosure of the residual, and whether
the answer is true of the target. */
#pragma once

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "research/membership.h"
#include "research/scenarios.h"
#include "research/truth.h"

namespace forereach::research {

/** How a plan was decided, and the tube as far as it was computed. */
struct Answer {
  Decision decision;
  Tube tube;

  /** Whether the tube reaches the horizon: certificates and S. */
  [[nodiscard]] bool IsComplete() const {
    return decision.outcome == Outcome::kCertified || decision.outcome == Outcome::kSafety;
  }
};

/** Answers plans about one system. Refers to system and residual, which must outlive it. */
class Evaluator final {
 public:
  /** @param zonotope_order 5 is the paper's; 1 makes every slice a box. */
  Evaluator(const System& system, const ResidualEnclosure& residual, int zonotope_order);

  /** Certifier::Certify for the scenario's plan, X_0 and obstacle. Reuses the memory of `answer`. */
  void Certify(const Scenario& scenario, Answer& answer) const;

 private:
  const System& system_;
  Certifier certifier_;
};

/** Whether each state of a rollout lies in its slice, as far as the tube goes: outside if one provably does not.
Neither the envelopes nor any theorem is used. */
[[nodiscard]] Membership LocateRollout(const Answer& answer, const Rollouts& rollouts, int i);

/** Whether every rollout lies in every slice of the tube, as far as it goes: outside if one provably leaves, undecided
if that is not known of all. A rollout is inside if its residuals lie in the recorded envelopes: it started in X_0, and
the step from slice to slice is sound. If they do not, LocateRollout decides. */
[[nodiscard]] Membership Cover(const Answer& answer, const Rollouts& rollouts);

/** The area of P X_t, by plain arithmetic. */
[[nodiscard]] double ProjectedArea(const Zonotope& slice);

}  // namespace forereach::research
