/** Models as text for tests, without a task file. */
#pragma once

#include <array>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "forereach/dynamics/model_text.h"

namespace forereach {

inline void PrintTo(ModelText::Integrator integrator, std::ostream* out) {
  *out << std::array{"none", "euler", "midpoint", "rk4"}[static_cast<std::size_t>(integrator)];
}

using Lines = std::vector<std::pair<std::string, std::string>>;  ///< Names, each with an expression.

/** @param states of each state its name and equation. */
[[nodiscard]] inline ModelText TextModel(const Lines& states, const std::vector<std::string>& inputs,
                                         std::vector<ModelText::Parameter> parameters, const Lines& definitions = {},
                                         ModelText::Integrator integrator = ModelText::Integrator::kNone) {
  ModelText model;
  model.name = model.file = "test";
  model.parameters = std::move(parameters);
  model.integrator = integrator;
  for (const std::string& name : inputs) model.inputs.push_back({name, "1"});
  for (const auto& [name, text] : definitions) model.definitions.push_back({name, {text, 1, 1}});
  for (const auto& [name, text] : states) {
    model.states.push_back({name, "1"});
    model.equations.push_back({text, 1, 1});
  }
  return model;
}

[[nodiscard]] inline ModelText BicycleText(double dt, double wheelbase) {
  return TextModel({{"x", "x + dt*v*cos(theta)"},
                    {"y", "y + dt*v*sin(theta)"},
                    {"theta", "theta + dt/wheelbase*v*tan(delta)"},
                    {"v", "v + dt*a"},
                    {"a", "a + dt*jerk"},
                    {"delta", "delta + dt*steer_rate"}},
                   {"jerk", "steer_rate"}, {{"dt", dt, dt}, {"wheelbase", wheelbase, wheelbase}});
}

[[nodiscard]] inline ModelText PointMassText(double dt) {
  return TextModel(
      {{"px", "px + dt*vx + half*ax"}, {"py", "py + dt*vy + half*ay"}, {"vx", "vx + dt*ax"}, {"vy", "vy + dt*ay"}},
      {"ax", "ay"}, {{"dt", dt, dt}}, {{"half", "dt^2/2"}});
}

/** A quadrotor in rates: position, roll, pitch, yaw, velocity, angular rates; thrust and torques. */
[[nodiscard]] inline ModelText QuadrotorText(ModelText::Integrator integrator) {
  return TextModel({{"x", "vx"},
                    {"y", "vy"},
                    {"z", "vz"},
                    {"phi", "p + (q*sin(phi) + r*cos(phi))*tan(theta)"},
                    {"theta", "q*cos(phi) - r*sin(phi)"},
                    {"psi", "(q*sin(phi) + r*cos(phi))/cos(theta)"},
                    {"vx", "lift*(cos(phi)*sin(theta)*cos(psi) + sin(phi)*sin(psi))"},
                    {"vy", "lift*(cos(phi)*sin(theta)*sin(psi) - sin(phi)*cos(psi))"},
                    {"vz", "lift*cos(phi)*cos(theta) - g"},
                    {"p", "((iy - iz)*q*r + tx)/ix"},
                    {"q", "((iz - ix)*p*r + ty)/iy"},
                    {"r", "((ix - iy)*p*q + tz)/iz"}},
                   {"f", "tx", "ty", "tz"},
                   {{"dt", 0.05, 0.05},
                    {"m", 0.5, 0.5},
                    {"g", 9.81, 9.81},
                    {"ix", 0.0023, 0.0023},
                    {"iy", 0.0023, 0.0023},
                    {"iz", 0.004, 0.004}},
                   {{"lift", "f/m"}}, integrator);
}

}  // namespace forereach
