/** One plan under one method: the tube, the answer, and whether the answer is true of the target.

Algorithm 1 as the certifier runs it (certifier/certify), with any enclosure of the residual in the envelope's place. */
#pragma once

#include <vector>

#include "certifier/certify/decision.h"
#include "certifier/reach/propagator.h"
#include "certifier/residual/enclosure.h"
#include "certifier/safety/projection.h"
#include "experiments/membership.h"
#include "experiments/scenarios.h"
#include "experiments/truth.h"

namespace forereach::experiments {

/** The slices X_0 .. X_length as far as they were computed, and how it ended. */
struct Answer {
  Outcome outcome = Outcome::kNone;
  int step = -1;   ///< The first step that fails; -1 for a certificate
  int length = 0;  ///< Completed steps
  std::vector<Zonotope> slices;
  std::vector<StepRecord> steps;

  /** Whether the tube reaches the horizon: certificates and S. */
  [[nodiscard]] bool IsComplete() const { return outcome == Outcome::kCertified || outcome == Outcome::kSafety; }
};

/** Answers plans about one system. Refers to its parts, which must outlive it. */
class Evaluator final {
 public:
  /** @param zonotope_order 5 is the paper's; 1 makes every slice a box. */
  Evaluator(const System& system, const ResidualEnclosure& residual, int zonotope_order);

  /** D at its first step ends the tube; S is decided after the horizon, at its first unsafe t in 0..T. An envelope
  without any admissible residual is F at that step. Reuses the memory of `answer`. */
  void Certify(const Scenario& scenario, Answer& answer) const;

 private:
  const System& system_;
  Projection projection_;
  Propagator propagator_;
};

/** Whether every rollout lies in every slice of the tube, as far as it goes: outside if one provably leaves, undecided
if that is not known of all. A rollout is inside if its residuals lie in the recorded envelopes: it started in X_0, and
the step from slice to slice is sound. If they do not, each of its states is located in its slice. */
[[nodiscard]] Membership Cover(const Answer& answer, const Rollouts& rollouts);

/** The area of P X_t, by plain arithmetic. */
[[nodiscard]] double ProjectedArea(const Zonotope& slice);

}  // namespace forereach::experiments
