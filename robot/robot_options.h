/** The options of the simulated robot, from `robot` in a task file. */
#pragma once

#include <map>
#include <string>
#include <vector>

namespace forereach {

struct RobotOptions {
  std::vector<double> start;         ///< The first state in the model's units, one entry for each state.
  std::vector<std::string> hold;     ///< The states that are zero while the robot stands. Empty: those of the model.
  double step_period_ms = 40;        ///< The wall-clock time of one model step.
  double time_limit_s = 40;          ///< The run ends at this time even without reaching the goal.
  std::string residual = "none";     ///< The difference from the model: none, heading_saturation or velocity_knee.
  std::string disturbance = "none";  ///< What disturbs each step: none, random or adversarial (disturbance.h).
  int disturbance_seed = 1;          ///< Of its random numbers.
  std::map<std::string, double> residual_parameters;  ///< All parameters, with the model's dt and wheelbase.
};

}  // namespace forereach
