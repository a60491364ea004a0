#include "planner_bridge/lessons.h"

#include <cmath>

namespace forereach {

void Lessons::Learn(const Decision& decision) {
  const auto limit = static_cast<std::size_t>(decision.coordinate);
  const double beyond = std::abs(decision.margin - decision.threshold);
  if (decision.cause == Cause::kNoStop) return;
  if (decision.outcome == Outcome::kDomain) ++domain_exits_;
  if (decision.outcome == Outcome::kSafety && decision.cause != Cause::kLimit) clearance_ += step_;
  if (decision.cause == Cause::kLimit && limit < limit_margin_.size() && std::isfinite(beyond))
    limit_margin_[limit] += beyond;
}

Eigen::VectorXd Lessons::DomainMargin(const Eigen::VectorXd& half_width, const Eigen::MatrixXd& projection) const {
  Eigen::VectorXd margin = domain_exits_ * 2 * half_width;
  for (Eigen::Index k = 0; k < margin.size(); ++k)
    if (projection.col(k).any()) margin(k) = domain_exits_ * step_;
  return margin;
}

}  // namespace forereach
