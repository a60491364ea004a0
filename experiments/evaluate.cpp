#include "experiments/evaluate.h"

#include <algorithm>
#include <cmath>

#include "certifier/safety/separation.h"
#include "certifier/sets/zonogon.h"

namespace forereach::experiments {
namespace {

Outcome OutcomeOf(StepResult::Status status) {
  switch (status) {
    case StepResult::Status::kDone: return Outcome::kNone;
    case StepResult::Status::kInconsistent: return Outcome::kFalsified;
    default: return Outcome::kDomain;
  }
}

bool IsClear(const Projection& projection, const Zonotope& slice, std::span<const double> half_width,
             const Obstacle& obstacle) {
  if (SeparateHulls(projection.EncloseHull(slice, half_width), obstacle).IsProven()) return true;
  Zonotope projected;
  projection.Enclose(slice, half_width, projected);
  return Separate(projected, obstacle).IsProven();
}

bool ResidualsAreEnclosed(const Answer& answer, const Rollouts& rollouts, int i) {
  for (int t = 0; t < answer.length; ++t) {
    const ResidualBounds& bounds = answer.steps[static_cast<std::size_t>(t)].envelope;
    const std::span<const double> r = rollouts.residual(i, t);
    for (std::size_t k = 0; k < r.size(); ++k)
      if (!(bounds.lower[k] <= r[k] && r[k] <= bounds.upper[k])) return false;
  }
  return true;
}

// From the end, where what has left is farthest outside.
Membership LocateAll(const Answer& answer, const Rollouts& rollouts, int i) {
  Membership all = Membership::kInside;
  for (int t = answer.length; t >= 0; --t) {
    const Membership at = Locate(answer.slices[static_cast<std::size_t>(t)], rollouts.state(i, t));
    if (at == Membership::kOutside) return at;
    if (at == Membership::kUndecided) all = at;
  }
  return all;
}

}  // namespace

Evaluator::Evaluator(const System& system, const ResidualEnclosure& residual, int zonotope_order)
    : system_(system),
      projection_(system.projection(), system.num_states()),
      propagator_(*system.model, system.domain, residual, zonotope_order, forereach::Method::kPaper) {}

void Evaluator::Certify(const Scenario& scenario, Answer& answer) const {
  const auto horizon = static_cast<std::size_t>(scenario.controls.cols());
  answer.outcome = Outcome::kNone;
  answer.step = -1;
  answer.length = 0;
  answer.slices.resize(horizon + 1);
  answer.steps.resize(horizon + 1);
  answer.slices[0].Assign(Zonotope::FromBox(scenario.center, system_.initial_half_width));
  Propagator::HalfWidths(answer.slices[0], answer.steps[0].half_width.data());
  for (std::size_t t = 0; t < horizon; ++t) {
    const auto column = scenario.controls.col(static_cast<Eigen::Index>(t));
    const StepResult result =
        propagator_.Step(answer.slices[t], {column.data(), static_cast<std::size_t>(column.size())}, answer.steps[t],
                         answer.slices[t + 1], answer.steps[t + 1].half_width.data());
    answer.outcome = OutcomeOf(result.status);
    answer.step = static_cast<int>(t);
    if (answer.outcome != Outcome::kNone) return;
    answer.length = static_cast<int>(t) + 1;
  }
  const Obstacle obstacle = Obstacle::Circle(scenario.obstacle.center, scenario.obstacle.radius);
  const auto n = static_cast<std::size_t>(system_.num_states());
  for (std::size_t t = 0; t <= horizon; ++t) {
    if (IsClear(projection_, answer.slices[t], {answer.steps[t].half_width.data(), n}, obstacle)) continue;
    answer.outcome = Outcome::kSafety;
    answer.step = static_cast<int>(t);
    return;
  }
  answer.outcome = Outcome::kCertified;
  answer.step = -1;
}

Membership Cover(const Answer& answer, const Rollouts& rollouts) {
  Membership all = Membership::kInside;
  for (int i = 0; i < rollouts.count(); ++i) {
    if (ResidualsAreEnclosed(answer, rollouts, i)) continue;
    const Membership found = LocateAll(answer, rollouts, i);
    if (found == Membership::kOutside) return found;
    if (found == Membership::kUndecided) all = found;
  }
  return all;
}

double ProjectedArea(const Zonotope& slice) {
  const Zonotope projected(slice.CenterVector().head(2), slice.GeneratorMatrix().topRows(2));
  const std::vector<Eigen::Vector2d> corners = Outline(projected);
  double twice = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d a = corners[i] - corners[0], b = corners[(i + 1) % corners.size()] - corners[0];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(twice) / 2;
}

}  // namespace forereach::experiments
