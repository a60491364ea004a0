/** The options of the planner, from `planner` in a task file. */
#pragma once

#include <string>
#include <vector>

namespace forereach {

struct PlannerOptions {
  std::string source = "ompl";  ///< Or policy.
  std::string policy;           ///< The policy's file. Set if the source is policy.
  std::string algorithm = "kpiece";
  std::vector<double> goal;     ///< In the safety coordinates, metres.
  double goal_radius = 1.0;     ///< Metres.
  double clearance = 0.3;       ///< The planner inflates obstacles by this, metres.
  double clearance_step = 0.1;  ///< Added to the clearance after each abstention S of a planning round, metres.
  int progress_steps = 8;       ///< The number of controls before the braking tail.
  int tail_steps = 40;          ///< The largest number of controls in the braking tail.
  int lead_steps = 2;           ///< A candidate starts this many steps after the state from which it was planned.
  int candidates = 12;          ///< The largest number of candidates for one start.
  int policy_samples = 1;       ///< Candidates of a learned policy at once.
  bool certifies = false;       ///< The search keeps to what is certified.
  bool repairs = false;         ///< Candidates ask for a repair, and one that comes is sent.
  double cruise_speed = 8;      ///< m/s
  double braking = 2.5;         ///< m/s^2
  double time_limit_ms = 15;    ///< Of one OMPL query, as work: see MakeOmplProposer.
  int seed = 1;
  std::vector<double> initial_half_width;  ///< Half-widths of each candidate's X0 without the state error, one a state.
};

}  // namespace forereach
