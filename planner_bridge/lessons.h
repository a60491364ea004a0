/** Requirements on the next candidate from one start, learned from the abstentions of earlier candidates from it. */
#pragma once

#include <Eigen/Core>

#include "certifier/certify/decision.h"
#include "planner_bridge/planner_options.h"

namespace forereach {

class Lessons final {
 public:
  /** Starts with planner.clearance and without a margin from the domain's bounds. */
  explicit Lessons(const PlannerOptions& options) : clearance_(options.clearance), step_(options.clearance_step) {}

  /** An abstention S adds planner.clearance_step to the clearance, an abstention D adds to the margin. No other outcome
  changes anything. Neither do the causes kNoStop and kLimit: they
  say nothing about the domain's bounds and the obstacles. */
  void Learn(Outcome outcome, Cause cause);

  /** The distance that the next candidate keeps from obstacles, metres. */
  [[nodiscard]] double clearance() const { return clearance_; }
  /** The distance that the next candidate keeps from the bounds of the state domain, n entries in model units. Each
  abstention D adds twice the half-width of X_0, because the tube reaches at least one half-width beyond its center, or
  planner.clearance_step for a state that the projection uses.
  @param half_width of X_0, n entries. @param projection P, p-by-n. */
  [[nodiscard]] Eigen::VectorXd DomainMargin(const Eigen::VectorXd& half_width,
                                             const Eigen::MatrixXd& projection) const;

 private:
  double clearance_, step_;
  int domain_exits_ = 0;
};

}  // namespace forereach
