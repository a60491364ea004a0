#include "forereach/certify/rates.h"

#include <algorithm>
#include <cmath>

#include "forereach/dynamics/angles.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/recorded_successor.h"

namespace forereach {

double LeastChange(const Interval& a, const Interval& b, bool is_angle) noexcept {
  const auto least = [](const Interval& difference) { return std::max(difference.lower, -difference.upper); };
  Interval difference = b - a;
  if (!is_angle) return std::max(least(difference), 0.0);
  // After these turns the middle is half a turn or less from 0, up to rounding: with one turn more or less, no other
  // number of turns brings it nearer.
  difference = difference - Interval(std::round(difference.Middle() / kTurn.lower)) * kTurn;
  return std::max(std::min({least(difference), least(difference - kTurn), least(difference + kTurn)}), 0.0);
}

RateBounds::RateBounds(const Problem& problem) : problem_(&problem), period_(StepOf(*problem.model)) {
  const auto add = [&](int state, double rate, double step, const std::string& key, double longest) {
    if (rate < kInfinity)
      bounds_.push_back({state, rate, MulUp(rate, step), key, problem.model->IsAngle(state), longest});
  };
  // A step may begin early and end late. Rounded up: what is refuted has to be refuted for the longest step.
  const double step = AddUp(period_, MulUp(2, problem.timing.error));
  for (int k = 0; period_ > 0 && k < problem.timing.rate_bound.size(); ++k)
    add(k, problem.timing.rate_bound[k], step, "model.rate_bound." + problem.model->state_names()[ToSize(k)],
        kInfinity);
  if (const int heading = problem.body.heading; problem.between && heading >= 0)
    add(heading, problem.between->turn_rate, problem.between->period, "task.between.turn_rate",
        std::max(period_, problem.between->period));
}

Eigen::VectorXd RateBounds::Shown(std::span<const double> z, std::span<const double> next, double longer,
                                  bool is_learned) const {
  Eigen::VectorXd shown = Eigen::VectorXd::Zero(std::ssize(bounds_));
  if (!(period_ > 0)) return shown;  // a model without steps of a duration
  const Declaration& declaration = problem_->declaration;
  const bool is_exact = declaration.given_are_exact && !is_learned;
  const double duration = AddUp(period_, longer);
  for (std::size_t b = 0; b < bounds_.size(); ++b) {
    const Bound& bound = bounds_[b];
    if (duration > bound.longest) continue;
    const auto k = ToSize(bound.state);
    const double error = is_exact ? 0 : declaration.VariableError(bound.state);
    const Interval before(SubDown(z[k], error), AddUp(z[k], error));
    const double change = LeastChange(
        before, EncloseSuccessor(declaration, bound.state, next[k], bound.is_angle, is_exact), bound.is_angle);
    // Downward in all: a violation is a claim in real arithmetic (soundness 3.17), and it stops the robot's work.
    shown[static_cast<Eigen::Index>(b)] = DivDown(change, duration);
  }
  return shown;
}

const RateBounds::Bound* RateBounds::FindExceeded(const Eigen::VectorXd& shown) const {
  const Bound* worst = nullptr;
  double factor = 0;
  for (std::size_t b = 0; b < bounds_.size(); ++b) {
    const double rate = shown[static_cast<Eigen::Index>(b)];
    if (!(rate > bounds_[b].rate)) continue;
    if (const double by = FactorOf(rate, bounds_[b].rate); worst == nullptr || by > factor)
      worst = &bounds_[b], factor = by;
  }
  return worst;
}

std::optional<Violation> RateBounds::FindViolation(const Eigen::VectorXd& shown, int transition) const {
  const Bound* exceeded = FindExceeded(shown);
  if (exceeded == nullptr) return std::nullopt;
  return Violation{transition, -1, exceeded->state, shown[exceeded - bounds_.data()], exceeded->rate};
}

std::string KeyOfRate(const Problem& problem, int state) {
  const RateBounds all(problem);
  const RateBounds::Bound* least = nullptr;
  for (const RateBounds::Bound& bound : all.bounds())
    if (bound.state == state && (least == nullptr || bound.rate < least->rate)) least = &bound;
  return least == nullptr ? "" : least->key;
}

}  // namespace forereach
