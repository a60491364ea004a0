/** A plan that the task's own certifier has certified: propose, certify, learn from the abstention, propose again. */
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "certifier/certify/certifier.h"
#include "certifier/task/config.h"
#include "planner_bridge/proposer.h"

namespace forereach {

struct CertifiedPlan {
  Eigen::MatrixXd controls;   ///< One column a step, input units. No columns: no candidate was certified.
  int progress_steps = 0;     ///< The braking tail are the columns after these.
  Eigen::VectorXd end;        ///< Center of the tube's last slice in the safety coordinates, metres.
  bool reaches_goal = false;  ///< The tube's center comes within planner.goal_radius of planner.goal.
  Decision decision;          ///< On these controls. Without controls: on the last candidate; kNone if there was none.
  int candidates = 0;         ///< Certified or abstained from, over all.
};

/** Looks for the longest certified plan from task.initial_set towards planner.goal. The first candidate has one
progress part and a braking tail. Each further part begins where the center of the certified tube leaves the progress
part, and is kept only if the plan with it is certified as a whole. The search ends at the goal, at kMaxSteps, or after
planner.candidates searches for one part.
@param certifier  of config.problem. @param seed  the same seed gives the same plan.
Cost: at most planner.candidates searches and certify calls for each part. */
[[nodiscard]] CertifiedPlan FindCertifiedPlan(Proposer& proposer, const Certifier& certifier, const Config& config,
                                              std::uint32_t seed);

}  // namespace forereach
