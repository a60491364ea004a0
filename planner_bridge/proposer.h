/** Where candidate plans come from: a request for one start in, a plan with its braking tail out. A proposal is no
proof: candidates are certified or not by somebody else. */
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "certifier/certify/problem.h"
#include "certifier/task/config.h"
#include "planner_bridge/motion.h"

namespace forereach {

struct PlanRequest {
  Eigen::VectorXd state;          ///< Where the plan starts: n entries, model units.
  double clearance = 0;           ///< Kept from obstacles, m. One that is nearer at the start counts as it is there.
  Eigen::VectorXd domain_margin;  ///< Kept from the bounds of the state domain, n entries or none.
  std::uint32_t seed = 1;
  int attempt = 0;  ///< How often this start was asked for before.
};

struct Proposal {
  Eigen::MatrixXd controls;  ///< One column a step, input units.
  int progress_steps = 0;    ///< The braking tail are the columns after these.
  Eigen::MatrixXd states;    ///< The nominal rollout, one column more than controls.
};

class Proposer {
 public:
  virtual ~Proposer() = default;

  virtual void SetObstacles(std::vector<Obstacle> obstacles) = 0;
  [[nodiscard]] virtual const Motion& motion() const = 0;
  /** One candidate, or none if it finds none. Depends on the request and what it was made with alone. */
  [[nodiscard]] virtual std::optional<Proposal> Propose(const PlanRequest& request) = 0;
};

/** What planner.source names. @throws std::invalid_argument if the options do not fit the problem, PolicyError if the
policy cannot be used. */
[[nodiscard]] std::unique_ptr<Proposer> MakeProposer(const Config& config);

/** @throws std::invalid_argument unless there is a goal with an entry for each safety coordinate, and progress part and
braking tail together have 1 to kMaxSteps steps. */
void RequireGoalAndSteps(const Problem& problem, const PlannerOptions& options);

}  // namespace forereach
