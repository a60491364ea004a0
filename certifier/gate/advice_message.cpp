#include "certifier/gate/advice_message.h"

#include <algorithm>
#include <cmath>

#include "forereach/certify/tube.h"
#include "forereach/numerics/size.h"
#include "forereach/safety/clearance.h"

namespace forereach {
namespace {

advice_change_t Change(std::int16_t kind, int step, int index, double value) {
  advice_change_t change{};
  change.kind = kind;
  change.step = static_cast<std::int16_t>(step);
  change.index = static_cast<std::int16_t>(index);
  change.value = value;
  return change;
}

// The least distance from the middles of the slices to an obstacle, from a step on, as the test of each step sees the
// body.
double LeastDistanceOfMiddle(const Abstained& abstained, const Tube& tube, const Obstacle& obstacle, int first_step) {
  const Problem& problem = abstained.certifier.problem();
  const BodyPlaces places(*problem.model, problem.projection, problem.body);
  const auto at = [&](int t) {
    const Eigen::VectorXd middle = tube.slice(t).CenterVector();
    return places.At({middle.data(), ToSize(middle.size())});
  };
  double least = kInfinity;
  // Between two samples the body is in the hull of both, give or take what the path may bend, which is taken off.
  const int length = problem.between ? 1 : 0, end = tube.length() - length;
  for (int t = first_step; t <= end; ++t) {
    const std::vector<BodyPart> from = at(t), to = at(t + length);
    for (std::size_t i = 0; i < from.size(); ++i)
      least = std::min(least, ApproximateDistance(obstacle, from[i], to[i], abstained.plan.schedule, t, t + length) -
                                  (problem.between ? Deviation(*problem.between, problem.body.parts[i]) : 0));
  }
  return least;
}

std::vector<advice_change_t> ChangesForObstacles(const Abstained& abstained, Tube& tube, const SearchEffort& effort) {
  auto ways = FindWayClear(abstained.certifier, abstained.plan, abstained.obstacles.all(), tube, effort);
  if (!ways) return {};
  std::ranges::stable_sort(*ways, {}, &GivingWay::step);
  if (ways->size() > kMaxAdviceChanges) ways->resize(kMaxAdviceChanges);
  std::vector<advice_change_t> changes;
  for (const GivingWay& way : *ways) {
    if (!effort.goes_on()) return {};
    const double distance = way.shift.norm();
    advice_change_t& change = changes.emplace_back(Change(advice_change_t::OBSTACLE, way.step, way.obstacle, distance));
    const Obstacle farther = Shifted(abstained.obstacles[ToSize(way.obstacle)], way.shift);
    const double clearance = LeastDistanceOfMiddle(abstained, tube, farther, way.step);
    if (std::isfinite(clearance)) change.clearance = std::max(clearance, 0.0);
    for (Eigen::Index k = 0; k < way.shift.size(); ++k) change.direction[k] = -way.shift[k] / distance;
  }
  if (!effort.goes_on()) return {};
  const std::vector<Obstacle> farther = Shifted(abstained.obstacles.all(), *ways);
  const Decision again = abstained.certifier.Certify(abstained.plan, abstained.initial_set, farther, tube);
  // Each obstacle was moved by itself; whether all together certify the plan is certified, not concluded.
  for (advice_change_t& change : changes) change.verified = again.outcome == Outcome::kCertified ? 1 : 0;
  return changes;
}

std::vector<advice_change_t> ChangesForLimits(const Abstained& abstained, const Tube& tube) {
  std::vector<advice_change_t> changes;
  const LimitTest& limits = abstained.certifier.limits();
  for (int i = 0; i < static_cast<int>(limits.limits().size()) && changes.size() < kMaxAdviceChanges; ++i) {
    const auto reach = limits.Reach(i, abstained.plan, tube);
    if (!reach) continue;
    const Limit& limit = limits.limits()[ToSize(i)];
    const double below = limit.at_least - reach->lower, above = reach->upper - limit.at_most;
    const double beyond = std::max(below, above);
    // Not a sum that overflowed, nor a limit that holds.
    if (!(beyond > 0) || !std::isfinite(beyond)) continue;
    const int step = i == abstained.verdict.coordinate ? abstained.verdict.step : -1;
    changes.push_back(Change(advice_change_t::LIMIT, step, i, beyond));
    changes.back().direction[0] = below > above ? 1 : -1;
  }
  return changes;
}

std::vector<advice_change_t> ChangesForDomain(const Decision& verdict) {
  const DomainExit& exit = verdict.exit;
  const bool is_range = exit.kind == DomainExit::Kind::kLower || exit.kind == DomainExit::Kind::kUpper;
  const double beyond = std::abs(exit.value - exit.bound);
  if (!is_range || !std::isfinite(beyond)) return {};
  std::vector<advice_change_t> changes{Change(advice_change_t::DOMAIN, verdict.step, exit.index, beyond)};
  changes.back().direction[0] = exit.kind == DomainExit::Kind::kLower ? 1 : -1;
  return changes;
}

}  // namespace

std::vector<advice_change_t> ChangesFor(const Abstained& abstained, Tube& tube, const SearchEffort& effort) {
  switch (abstained.verdict.cause) {
    case Cause::kObstacle: return ChangesForObstacles(abstained, tube, effort);
    case Cause::kLimit: return ChangesForLimits(abstained, tube);
    case Cause::kDomainExit: return ChangesForDomain(abstained.verdict);
    case Cause::kNone:
    case Cause::kPairwise:
    case Cause::kNoFiniteEnclosure:
    case Cause::kNoStop:
    case Cause::kBetween:
    case Cause::kBound: return {};
  }
  return {};
}

}  // namespace forereach
