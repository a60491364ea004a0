/** Candidate plans from a learned policy of the bicycle: the first progress_steps of its block, then a braking tail.

The policy sees neither obstacles nor bounds, and nothing is checked here but that inputs lie in their domain: what may
not be driven, the certifier refuses, and the next candidate follows another reference. References start where the robot
is, at its speed, and change it towards cruise_speed. The first steers along the arc to the goal; the following ones
along kFan angles over the range that the policy was taught (reference.h), nearest to that arc first. */
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "planner_bridge/policy.h"
#include "planner_bridge/proposer.h"

namespace forereach {

class PolicyProposer final : public Proposer {
 public:
  static constexpr int kFan = 9;

  /** @throws std::invalid_argument unless the policy is of the problem's model, a bicycle judged in x and y, and has 12
  features and progress_steps steps; or if goal or steps do not fit. */
  PolicyProposer(std::shared_ptr<const Problem> problem, PlannerOptions options, Policy policy);

  void SetObstacles(std::vector<Obstacle>) override {}
  [[nodiscard]] const Motion& motion() const override { return *motion_; }
  /** None after 1 + kFan attempts, or if no tail of at most tail_steps ends the plan. Clearance, margin and seed are
  not looked at. */
  [[nodiscard]] std::optional<Proposal> Propose(const PlanRequest& request) override;

 private:
  [[nodiscard]] Eigen::VectorXd ReferenceStart(const Eigen::VectorXd& state, int attempt) const;
  [[nodiscard]] double Steering(const Eigen::VectorXd& state, double most, int attempt) const;

  std::shared_ptr<const Problem> problem_;
  PlannerOptions options_;
  Policy policy_;
  std::unique_ptr<Motion> motion_;
  double wheelbase_, duration_;  // m; s of a block
};

}  // namespace forereach
