#include "planner_bridge/proposer.h"

#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "planner_bridge/policy_proposer.h"
#include "planner_bridge/proposal.h"

namespace forereach {

std::unique_ptr<Proposer> MakeProposer(const Config& config) try {
  const std::string& source = config.planner.source;
  if (source == "policy") return std::make_unique<PolicyProposer>(config, LoadPolicy(config.planner.policy));
  if (source == "ompl") return MakeOmplProposer(config);
  throw std::invalid_argument(fmt::format("planner.source: {} is not ompl or policy", source));
} catch (const std::invalid_argument& error) {
  throw ConfigError("{}: {}", config.path, error.what());
}

void RequireGoalAndSteps(const Problem& problem, const PlannerOptions& options) {
  if (options.goal.empty())
    throw std::invalid_argument(
        fmt::format("planner.goal: missing: where to go, an entry for each of the {} safety coordinates",
                    problem.projection.rows()));
  if (std::ssize(options.goal) != problem.projection.rows())
    throw std::invalid_argument(
        fmt::format("planner.goal: {} entries, it has to have {}", options.goal.size(), problem.projection.rows()));
  if (problem.projection.isZero(0))
    throw std::invalid_argument("task.body.pose: missing: planner.goal is given in these states");
  if (options.progress_steps < 1 || options.tail_steps < 0 || options.progress_steps + options.tail_steps > kMaxSteps)
    throw std::invalid_argument(
        fmt::format("planner.progress_steps + planner.tail_steps: more than {} steps, or none", kMaxSteps));
}

}  // namespace forereach
