/** What a task file says of the planner. */
#pragma once

#include <string>
#include <vector>

namespace forereach {

struct PlannerOptions {
  std::string source = "ompl";  ///< Or policy.
  std::string policy;           ///< Its file; from a task file never empty if the source is policy.
  std::string algorithm = "kpiece";
  std::vector<double> goal;     ///< In the safety coordinates, metres.
  double goal_radius = 1.0;     ///< Metres.
  double clearance = 0.3;       ///< Obstacles are inflated by this for planning, metres.
  double clearance_step = 0.1;  ///< Added after each abstention S of one planning round, metres.
  int progress_steps = 8;       ///< Controls before the braking tail.
  int tail_steps = 40;          ///< Longest braking tail.
  int lead_steps = 2;           ///< A candidate starts this many steps after the state it was planned from.
  int candidates = 12;          ///< Candidates for one start at most.
  double cruise_speed = 8;      ///< m/s
  double braking = 2.5;         ///< m/s^2
  double time_limit_ms = 15;    ///< For one OMPL query.
  int seed = 1;
  std::vector<double> initial_half_width;  ///< X0 of each candidate; from a file one entry for each state.
};

}  // namespace forereach
