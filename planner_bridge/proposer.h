/** The interface of planners: from a request for one start to a plan with its braking tail. A proposal has no
guarantee; the certifier decides on it. */
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "forereach/certify/problem.h"
#include "task/config.h"
#include "task/motion.h"

namespace forereach {

/** A distance to keep from one obstacle, from a step of the plan on: later slices are wider. */
struct ObstacleClearance {
  double clearance = 0;  ///< Metres.
  int first_step = 0;
};

inline constexpr std::uint32_t kSeedSpread = 1'000'003;

struct PlanRequest {
  Eigen::VectorXd state;  ///< Initial state of the plan: n entries, model units.
  double clearance = 0;   ///< Distance to keep from obstacles, m; less if the start is nearer to an obstacle.
  Eigen::VectorXd
      domain_margin;       ///< Distance to keep from the bounds of the state domain: n entries, or empty for none.
  std::uint32_t seed = 1;  ///< Of the search. Those of two runs are multiples of kSeedSpread, so they share none.
  int attempt = 0;         ///< Number of earlier requests for this start.
  Schedule schedule{};     ///< Of the plan: it is where moving obstacles are at each step.
  /** Distance to keep from the bounds of each limit of the task, in its unit, or empty for none; less if the start is
  nearer to them. */
  std::vector<double> limit_margin = {};
  /** More for single obstacles, by their index; those beyond its end have none. From step 0 on: less if the start is
  nearer. */
  std::vector<ObstacleClearance> obstacle_clearance = {};
  /** Whether the candidate may be what the task's hints do, whatever the seed is: once for each start, since the same
  request would give it again. */
  bool may_follow_hints = false;
  /** For planner.certifies: X_0 of the plan, and the controls that lead from it to `state`, m-by-t; the request's
  schedule begins after them. Without X_0 such a search finds nothing. */
  std::shared_ptr<const Zonotope> initial_set = {};
  Eigen::MatrixXd before = {};
};

struct Proposal {
  Eigen::MatrixXd controls;  ///< One column for each step, input units.
  int progress_steps = 0;    ///< Number of columns before the braking tail.
  Eigen::MatrixXd states;    ///< The nominal rollout, with one column more than controls.
};

class Proposer {
 public:
  virtual ~Proposer() = default;

  virtual void SetObstacles(std::vector<Obstacle> obstacles) = 0;
  [[nodiscard]] virtual const RobotMotion& motion() const = 0;
  /** One candidate, or nothing if none was found. The result depends only on the request, the construction and the
  obstacles. */
  [[nodiscard]] virtual std::optional<Proposal> Propose(const PlanRequest& request) = 0;
  /** Candidates for one start, the preferred ones first; empty if none was found. By default what Propose gives. */
  [[nodiscard]] virtual std::vector<Proposal> ProposeMany(const PlanRequest& request) {
    std::optional<Proposal> one = Propose(request);
    return one ? std::vector{*std::move(one)} : std::vector<Proposal>{};
  }
  /** Whether a robot at rest in the request's state has room to drive on in a direction, a unit vector in safety
  coordinates, among the obstacles that stand. True if the planner does not know. */
  [[nodiscard]] virtual bool HasRoom(const PlanRequest& /*request*/, const Eigen::VectorXd& /*direction*/) {
    return true;
  }
};

/** Makes the proposer that planner.source names. @throws ConfigError if the options do not match the problem, as of a
task for certifying that has no goal; PolicyError if the policy cannot be used. */
[[nodiscard]] std::unique_ptr<Proposer> MakeProposer(const Config& config);

/** Checks goal and steps. @throws std::invalid_argument unless the goal has an entry for each safety coordinate, these
are states of the robot, and progress part and braking tail together have 1 to kMaxSteps steps. */
void RequireGoalAndSteps(const Problem& problem, const PlannerOptions& options);

}  // namespace forereach
