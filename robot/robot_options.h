/** What a task file says of the simulated robot. */
#pragma once

#include <map>
#include <string>
#include <vector>

namespace forereach {

struct RobotOptions {
  std::vector<double> start;      ///< State, model units; from a file one entry for each state.
  double step_period_ms = 40;     ///< Wall-clock time of one model step.
  double time_limit_s = 40;       ///< The run ends then, goal or not.
  std::string residual = "none";  ///< How the real robot differs: none, heading_saturation, velocity_knee.
  std::map<std::string, double> residual_parameters;  ///< From a file all of them, with the model's dt and wheelbase.
};

}  // namespace forereach
