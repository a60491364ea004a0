/** Candidate plans: a progress part found by OMPL and a braking tail that ends at standstill.

The progress part is the answer to a query of bounded length, not a path to the goal: exactly `progress_steps` controls
that come nearer to it, measured around the obstacles, and from whose end a braking tail fits. All of it is checked
along the nominal rollout, in the certifier's own discretisation, against obstacles grown by a clearance and against
the domain. That is no proof: candidates are certified or not by somebody else. */
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
};

struct Proposal {
  Eigen::MatrixXd controls;  ///< One column a step, input units.
  int progress_steps = 0;    ///< The braking tail are the columns after these.
  Eigen::MatrixXd states;    ///< The nominal rollout, one column more than controls.
};

class Planner final {
 public:
  /** @throws std::invalid_argument for a model without Motion, an unknown algorithm, or a goal or horizon that does not
  fit. */
  Planner(std::shared_ptr<const Problem> problem, PlannerOptions options, std::vector<Obstacle> obstacles);
  ~Planner();

  void SetObstacles(std::vector<Obstacle> obstacles);
  [[nodiscard]] const Motion& motion() const;

  /** One candidate, or none if the search's work allowance ran out: kStepsPerMs propagated model steps per millisecond
  of options.time_limit_ms. Work is counted and no clock read, so that the answer depends on request, options and
  obstacles alone. A navigation field is computed once per obstacles and clearance, some 10 ms.
  Single-threaded, for the whole process: OMPL's seed is global. */
  [[nodiscard]] std::optional<Proposal> Propose(const PlanRequest& request);

  /** Appends progress parts until the goal is reached or no more fit, then one braking tail: one plan of at most
  kMaxSteps controls from request.state to the goal, or as far as they take it. */
  [[nodiscard]] std::optional<Proposal> ProposeToGoal(const PlanRequest& request);

  static constexpr int kStepsPerMs = 400;

 private:
  class Search;
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace forereach
