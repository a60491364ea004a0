#include "forereach/certify/standing.h"

#include <algorithm>

namespace forereach {
namespace {

// How many steps of a plan whose first failure is this verdict still stand (docs/soundness.md, 3.13). A swept unit t is
// the time after sample t, so the t steps before it stand. A failure at sample t alone takes the step that ends there.
int StandingSteps(const Decision& verdict, int num_steps, bool is_swept) {
  if (verdict.outcome == Outcome::kCertified || verdict.cause == Cause::kNoStop) return num_steps;
  if (verdict.outcome == Outcome::kDomain) return verdict.step;
  if (verdict.outcome == Outcome::kSafety)
    return std::max(is_swept && verdict.cause == Cause::kObstacle ? verdict.step : verdict.step - 1, 0);
  return 0;
}

}  // namespace

Standing JudgeAgain(const Certifier& certifier, const Plan& plan, const Zonotope& initial_set,
                    const ObstacleView& obstacles, Tube& tube, int first_step) noexcept {
  const auto standing = [&](const Decision& verdict) {
    return Standing{StandingSteps(verdict, plan.num_steps, certifier.problem().between.has_value()), verdict};
  };
  const Decision verdict = certifier.Certify(plan, initial_set, obstacles, tube);
  const Standing whole = standing(verdict);
  if (verdict.outcome == Outcome::kCertified || verdict.outcome == Outcome::kFalsified) return whole;
  // Certify has not tested S after D. A failure of S before first_step is past.
  const Standing safe = standing(certifier.JudgeSafety(plan, obstacles, tube, first_step));
  if (verdict.outcome == Outcome::kSafety) return safe;
  return safe.verdict.outcome == Outcome::kSafety && safe.steps < whole.steps ? safe : whole;
}

}  // namespace forereach
