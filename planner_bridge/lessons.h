/** What the abstentions from one start ask of the next candidate from there. */
#pragma once

#include <Eigen/Core>

#include "certifier/certify/decision.h"
#include "certifier/task/config.h"

namespace forereach {

class Lessons final {
 public:
  /** Nothing has been learned: planner.clearance, and no margin from the domain's bounds. */
  explicit Lessons(const PlannerOptions& options) : clearance_(options.clearance), step_(options.clearance_step) {}

  /** An abstention S adds planner.clearance_step to the clearance, an abstention D adds to the margin. No other outcome
  changes anything. */
  void Learn(Outcome outcome);

  /** What the next candidate keeps from obstacles, metres. */
  [[nodiscard]] double clearance() const { return clearance_; }
  /** What it keeps from the bounds of the state domain, n entries in model units: for each abstention D twice the
  half-width of X_0, by which the tube is certain to reach beyond its center, or planner.clearance_step for a state that
  the projection reads.
  @param half_width  of X_0, n entries. @param projection  P, p-by-n. */
  [[nodiscard]] Eigen::VectorXd DomainMargin(const Eigen::VectorXd& half_width,
                                             const Eigen::MatrixXd& projection) const;

 private:
  double clearance_, step_;
  int domain_exits_ = 0;
};

}  // namespace forereach
