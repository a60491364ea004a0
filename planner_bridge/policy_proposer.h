/** Candidate plans from a learned policy of the bicycle: the first progress_steps of its block, then a braking tail.

The policy does not take obstacles or bounds into account. The proposer checks only that inputs lie in their domain and
that the nominal model keeps the task's limits at each sample. If the certifier refuses a candidate, the next candidate
follows another reference. References start at the robot's state and speed and change the speed towards cruise_speed.
The first one follows the arc to the goal. The next ones follow kFan steering angles over the range of the training
(reference.h), starting with the angle nearest to that arc.

With planner.policy_samples, one request gives so many candidates: those of all references by the first way to brake;
then of further ones, towards any angle and speed, by the seed; then the same by the task's other ways to brake. */
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
  /** Up to planner.policy_samples of them, fewer if some are no candidates. If it is 1, as Propose. With more, each
  attempt draws others, and there is no last one. */
  [[nodiscard]] std::vector<Proposal> ProposeMany(const PlanRequest& request) override;

 private:
  // Where a reference leads: to a steering angle of the fan, and a speed.
  struct Aim {
    double steering, speed;
  };
  [[nodiscard]] Aim AimOf(const Eigen::VectorXd& state, int attempt) const;
  [[nodiscard]] Eigen::VectorXd ReferenceStart(const Eigen::VectorXd& state, const Aim& aim) const;
  [[nodiscard]] bool CanServe(const PlanRequest& request) const;
  [[nodiscard]] double Acceleration(const Eigen::VectorXd& state, double speed) const;
  [[nodiscard]] double MostSteering(const Eigen::VectorXd& state, double speed) const;
  [[nodiscard]] double Steering(const Eigen::VectorXd& state, double most, int attempt) const;
  [[nodiscard]] std::optional<Eigen::MatrixXd> Progress(const Eigen::VectorXd& state, const Aim& aim) const;
  [[nodiscard]] std::optional<Proposal> WithTail(const Eigen::VectorXd& state, const Eigen::MatrixXd& progress,
                                                 int way) const;

  [[nodiscard]] bool KeepsAllLimits(const Proposal& proposal) const;

  std::shared_ptr<const Problem> problem_;
  LimitValues limits_;
  PlannerOptions options_;
  Policy policy_;
  RobotMotion motion_;
  double wheelbase_, duration_;  // m; s of a block
};

}  // namespace forereach
