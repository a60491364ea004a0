/** Candidate plans: a progress part found by OMPL and a braking tail that ends at standstill.

The progress part is the answer to a query of bounded length, not a path to the goal: exactly `progress_steps` controls
that come nearer to it, measured around the obstacles, and from whose end a braking tail fits. All of it is checked
along the nominal rollout, in the certifier's own discretisation, against obstacles grown by a clearance and against
the domain. */
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "planner_bridge/proposer.h"

namespace forereach {

class Planner final : public Proposer {
 public:
  /** @throws std::invalid_argument for a model without Motion, an unknown algorithm, or a goal or horizon that does not
  fit. */
  Planner(std::shared_ptr<const Problem> problem, PlannerOptions options, std::vector<Obstacle> obstacles);
  ~Planner() override;

  void SetObstacles(std::vector<Obstacle> obstacles) override;
  [[nodiscard]] const Motion& motion() const override;

  /** One candidate, or none if the search's work allowance ran out: kStepsPerMs propagated model steps per millisecond
  of options.time_limit_ms. Work is counted and no clock read, so that the answer depends on request, options and
  obstacles alone. A navigation field is computed once per obstacles and clearance, some 10 ms.
  Single-threaded, for the whole process: OMPL's seed is global. */
  [[nodiscard]] std::optional<Proposal> Propose(const PlanRequest& request) override;

  static constexpr int kStepsPerMs = 400;

 private:
  class Search;
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace forereach
