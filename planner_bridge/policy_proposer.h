/** Candidate plans from a learned policy of the bicycle: the first progress_steps of its block, then a braking tail.

The policy does not take obstacles or bounds into account. The proposer checks only that inputs lie in their domain and
that the nominal model keeps the task's limits at each sample. If the certifier refuses a candidate, the next candidate
follows another reference. References start at the robot's state and speed and change the speed towards cruise_speed.
The first one follows the arc to the goal. The next ones follow kFan steering angles over the range of the training
(reference.h), starting with the angle nearest to that arc. */
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "forereach/safety/limit_values.h"
#include "planner_bridge/policy.h"
#include "planner_bridge/proposer.h"

namespace forereach {

class PolicyProposer final : public Proposer {
 public:
  static constexpr int kFan = 9;

  /** @throws std::invalid_argument unless the policy belongs to the problem's model, the model has the states and the
  wheelbase of a bicycle with x and y as safety coordinates, and the policy has 12 features and progress_steps steps;
  also if the goal or the steps are invalid. ConfigError as RobotMotion. */
  PolicyProposer(const Config& config, Policy policy);

  void SetObstacles(std::vector<Obstacle>) override {}
  [[nodiscard]] const RobotMotion& motion() const override { return motion_; }
  /** One candidate. Nothing after 1 + kFan attempts, if no braking tail of at most tail_steps ends the plan, if the
  candidate exceeds a limit, or if one of its numbers is not finite. Clearance, margins and seed of the request are
  ignored. */
  [[nodiscard]] std::optional<Proposal> Propose(const PlanRequest& request) override;

 private:
  [[nodiscard]] Eigen::VectorXd ReferenceStart(const Eigen::VectorXd& state, int attempt) const;
  [[nodiscard]] double Steering(const Eigen::VectorXd& state, double most, int attempt) const;

  [[nodiscard]] bool KeepsAllLimits(const Proposal& proposal) const;

  std::shared_ptr<const Problem> problem_;
  LimitValues limits_;
  PlannerOptions options_;
  Policy policy_;
  RobotMotion motion_;
  double wheelbase_, duration_;  // m; s of a block
};

}  // namespace forereach
