/** Requirements on the next candidate from one start, learned from the abstentions of earlier candidates from it. */
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "forereach/advice_t.hpp"
#include "forereach/certify/decision.h"
#include "planner_bridge/proposer.h"
#include "task/planner_options.h"

namespace forereach {

class Lessons final {
 public:
  /** Starts with planner.clearance and without a margin from the domain's bounds or those of the task's limits. */
  Lessons(const PlannerOptions& options, std::size_t num_limits)
      : clearance_(options.clearance), step_(options.clearance_step), limit_margin_(num_limits, 0.0) {}

  /** An abstention S by an obstacle adds planner.clearance_step to the clearance, one by a limit adds what the tube may
  reach beyond it to the margin from this limit, and an abstention D adds to the margin from the domain's bounds. No
  other outcome changes anything. Neither do the causes kNoStop and kBetween: they say nothing about bounds and
  obstacles. */
  void Learn(const Decision& decision);

  /** The same from the certifier's advice, in the place of Learn: from the obstacles that it names the clearance that
  it gives, from its step on, or `value` more than was kept before if that is more; more room from the limits that it
  names, and from the bounds of a state's range. An index that is none of them, and a value that is not a finite
  distance, change nothing. @return whether something changed. */
  bool Heed(const advice_t& advice);

  /** Half of what advice asked for beyond clearance() and the domain's bounds is taken back: a search that kept it
  found nothing. */
  void Ease();

  /** The distance that the next candidate keeps from obstacles, metres. */
  [[nodiscard]] double clearance() const { return clearance_; }
  /** What it keeps from single obstacles, where more, by the obstacle's index. */
  [[nodiscard]] const std::vector<ObstacleClearance>& obstacle_clearance() const { return obstacle_clearance_; }
  /** The distances that the next candidate keeps from the bounds of the limits, one for each limit in its unit. */
  [[nodiscard]] const std::vector<double>& limit_margin() const { return limit_margin_; }
  /** The distance that the next candidate keeps from the bounds of the state domain, n entries in model units. Each
  abstention D adds twice the half-width of X_0, because the tube reaches at least one half-width beyond its center, or
  planner.clearance_step for a state that the projection uses.
  @param half_width of X_0, n entries. @param projection P, p-by-n. */
  [[nodiscard]] Eigen::VectorXd DomainMargin(const Eigen::VectorXd& half_width,
                                             const Eigen::MatrixXd& projection) const;

 private:
  bool HeedChange(const advice_change_t& change);

  double clearance_, step_;
  int domain_exits_ = 0;
  std::vector<ObstacleClearance> obstacle_clearance_;
  std::map<int, double> state_margin_;  // beyond that of domain_exits_
  std::vector<double> limit_margin_;
};

}  // namespace forereach
