#include "planner_bridge/lessons.h"

namespace forereach {

void Lessons::Learn(Outcome outcome, Cause cause) {
  if (cause == Cause::kNoStop || cause == Cause::kLimit) return;
  if (outcome == Outcome::kSafety) clearance_ += step_;
  if (outcome == Outcome::kDomain) ++domain_exits_;
}

Eigen::VectorXd Lessons::DomainMargin(const Eigen::VectorXd& half_width, const Eigen::MatrixXd& projection) const {
  Eigen::VectorXd margin = domain_exits_ * 2 * half_width;
  for (Eigen::Index k = 0; k < margin.size(); ++k)
    if (projection.col(k).any()) margin(k) = domain_exits_ * step_;
  return margin;
}

}  // namespace forereach
