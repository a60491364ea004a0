/** The search for a certified plan: propose, certify, learn from the abstention, propose again. */
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "forereach/certify/certifier.h"
#include "planner_bridge/proposer.h"
#include "task/config.h"

namespace forereach {

struct CertifiedPlan {
  Eigen::MatrixXd controls;   ///< One column for each step, input units. No columns: no candidate was certified.
  int progress_steps = 0;     ///< Number of columns before the braking tail.
  Eigen::VectorXd end;        ///< Center of the tube's last slice in the safety coordinates, metres.
  bool reaches_goal = false;  ///< Whether the tube's center comes within planner.goal_radius of planner.goal.
  Decision decision;          ///< The decision on these controls, or on the last candidate; kNone if there was none.
  int candidates = 0;         ///< Total number of candidates that were decided.
};

/** Searches for the longest certified plan from task.initial_set towards planner.goal. The first candidate has one
progress part and a braking tail. Each further progress part begins at the center of the certified tube at the end of
the last one, and is kept only if the whole plan with it is certified. The search ends at the goal, at kMaxSteps, or
after planner.candidates searches for one part.
@param certifier the certifier of config.problem. @param seed equal seeds give equal plans.
@param schedule of the plan, for obstacles that move.
Cost: at most planner.candidates searches and certify calls for each part. */
[[nodiscard]] CertifiedPlan FindCertifiedPlan(Proposer& proposer, const Certifier& certifier, const Config& config,
                                              std::uint32_t seed, const Schedule& schedule = {});

}  // namespace forereach
