#include "research/evaluate.h"

#include <cmath>
#include <memory>

#include "forereach/sets/zonogon.h"

namespace forereach::research {
namespace {

std::shared_ptr<const Problem> ProblemOf(const System& system, int zonotope_order) {
  auto problem = std::make_shared<Problem>();
  problem->model = system.model;
  problem->domain = system.domain;
  problem->projection = system.projection();
  problem->method = forereach::Method::kPaper;
  problem->zonotope_order = zonotope_order;
  return problem;
}

bool ResidualsAreEnclosed(const Answer& answer, const Rollouts& rollouts, int i) {
  for (int t = 0; t < answer.tube.length(); ++t) {
    const ResidualBounds& bounds = answer.tube.step(t).envelope;
    if (bounds.has_slope) return false;
    const std::span<const double> r = rollouts.residual(i, t);
    for (std::size_t k = 0; k < r.size(); ++k)
      if (!(bounds.lower[k] <= r[k] && r[k] <= bounds.upper[k])) return false;
  }
  return true;
}

}  // namespace

Evaluator::Evaluator(const System& system, const ResidualEnclosure& residual, int zonotope_order)
    : system_(system), certifier_(ProblemOf(system, zonotope_order), residual) {}

void Evaluator::Certify(const Scenario& scenario, Answer& answer) const {
  const auto inputs = static_cast<int>(scenario.controls.rows());
  const Plan plan{scenario.controls.data(), inputs, static_cast<int>(scenario.controls.cols()), inputs};
  const Obstacle obstacle = Obstacle::Circle(scenario.obstacle.center, scenario.obstacle.radius);
  const Zonotope initial_set = Zonotope::FromBox(scenario.center, system_.initial_half_width);
  answer.decision = certifier_.Certify(plan, initial_set, {&obstacle, 1}, answer.tube);
}

Membership LocateRollout(const Answer& answer, const Rollouts& rollouts, int i) {
  Membership all = Membership::kInside;
  // From the end, where what has left is farthest outside.
  for (int t = answer.tube.length(); t >= 0; --t) {
    const Membership at = Locate(answer.tube.slice(t), rollouts.state(i, t));
    if (at == Membership::kOutside) return at;
    if (at == Membership::kUndecided) all = at;
  }
  return all;
}

Membership Cover(const Answer& answer, const Rollouts& rollouts) {
  Membership all = Membership::kInside;
  for (int i = 0; i < rollouts.count(); ++i) {
    if (ResidualsAreEnclosed(answer, rollouts, i)) continue;
    const Membership found = LocateRollout(answer, rollouts, i);
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

}  // namespace forereach::research
