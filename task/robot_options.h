/** The options of the simulated robot, from `robot` in a task file. */
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace forereach {

struct RobotOptions {
  std::vector<double> start;  ///< The first state in the model's units, one entry for each state.
  /** The states that are zero while the robot stands. Not set: those of a compiled model. */
  std::optional<std::vector<std::string>> hold;
  /** The emergency stop: how fast each of these states, of those of hold, goes to zero, in its unit per second. The
  others of hold are zero at once. */
  std::map<std::string, double> emergency_stop;
  double step_period_ms = 40;         ///< The wall-clock time of one model step; in a task file model.dt by default.
  double time_limit_s = 40;           ///< The run ends at this time even without reaching the goal.
  std::string disturbance = "none";   ///< What disturbs each step: none, random or adversarial (disturbance.h).
  std::string sensor_error = "none";  ///< What its measurements are off by, likewise.
  std::string input_error = "none";   ///< What the inputs that act are off the plan's by, likewise.
  std::string step_jitter = "none";   ///< How its steps are off their times, likewise (step_jitter.h).
  int disturbance_seed = 1;           ///< Of the random numbers of all four.
};

}  // namespace forereach
