#include "planner_bridge/lessons.h"

#include <algorithm>
#include <cmath>

#include "forereach/numerics/size.h"

namespace forereach {

void Lessons::Learn(const Decision& decision) {
  const auto limit = static_cast<std::size_t>(decision.coordinate);
  const double beyond = std::abs(decision.margin - decision.threshold);
  // More distance from anything helps against neither.
  if (decision.cause == Cause::kNoStop || decision.cause == Cause::kBetween) return;
  if (decision.outcome == Outcome::kDomain) ++domain_exits_;
  if (decision.outcome == Outcome::kSafety && decision.cause != Cause::kLimit) clearance_ += step_;
  if (decision.cause == Cause::kLimit && limit < limit_margin_.size() && std::isfinite(beyond))
    limit_margin_[limit] += beyond;
}

bool Lessons::Heed(const advice_t& advice) {
  bool changed = false;
  const int count = std::clamp<int>(advice.num_changes, 0, static_cast<int>(std::size(advice.change)));
  for (int i = 0; i < count; ++i) changed = HeedChange(advice.change[i]) || changed;
  return changed;
}

bool Lessons::HeedChange(const advice_change_t& change) {
  const auto is_distance = [](double value) { return std::isfinite(value) && value > 0; };
  if (change.index < 0 || !is_distance(change.value)) return false;
  const std::size_t index = ToSize(change.index);
  switch (change.kind) {
    case advice_change_t::OBSTACLE: {
      if (obstacle_clearance_.size() <= index) obstacle_clearance_.resize(index + 1);
      ObstacleClearance& own = obstacle_clearance_[index];
      const bool is_first = own.clearance == 0;
      // An advice says how far the body's middle has to keep away, or only how much was missing.
      const double before = is_first ? 0 : own.clearance + change.value;
      const double told = is_distance(change.clearance) ? change.clearance : clearance_ + change.value;
      own.clearance = std::max(before, told);
      own.first_step = is_first ? change.step : std::min<int>(own.first_step, change.step);
      return true;
    }
    case advice_change_t::LIMIT:
      if (index >= limit_margin_.size()) return false;
      limit_margin_[index] += change.value;
      return true;
    case advice_change_t::DOMAIN: state_margin_[change.index] += change.value; return true;
    default: return false;
  }
}

void Lessons::Ease() {
  for (ObstacleClearance& own : obstacle_clearance_)
    // A search that finds nothing may have been told too much.
    if (own.clearance > clearance_) own.clearance = own.clearance / 2 + clearance_ / 2;
  for (auto& [k, more] : state_margin_) more /= 2;
}

Eigen::VectorXd Lessons::DomainMargin(const Eigen::VectorXd& half_width, const Eigen::MatrixXd& projection) const {
  Eigen::VectorXd margin = domain_exits_ * 2 * half_width;
  for (Eigen::Index k = 0; k < margin.size(); ++k)
    if (projection.col(k).any()) margin(k) = domain_exits_ * step_;
  for (const auto& [k, more] : state_margin_)
    if (k < margin.size()) margin(k) += more;
  return margin;
}

}  // namespace forereach
