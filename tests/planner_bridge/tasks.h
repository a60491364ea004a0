/** Two small tasks for the planner's tests. Their laws are those of the tasks that drive these models. */
#pragma once

#include <memory>
#include <string>

#include "task/config.h"
#include "tests/paths.h"
#include "tests/worlds.h"

namespace forereach {

inline Laws LawsOf(const std::string& drive) {
  return LoadConfig(FOREREACH_SOURCE_DIR "/config/drive/" + drive + ".yaml", TransitionsFile::kIgnore).laws;
}

inline Config Bicycle() {
  static const Laws laws = LawsOf("kinematic_bicycle");
  auto problem = std::make_shared<Problem>(
      WorldOf(MakeKinematicBicycle(0.1, 2.5), Box(Vec({-10, -15, -3, -0.5, -3, -0.48}), Vec({80, 15, 3, 12, 3, 0.48})),
              Within({10, 1})));
  problem->declaration.state_error = Vec({0, 0, 0, 0, 0, 0});
  problem->declaration.lipschitz(2, 3) = 0.018;
  problem->declaration.lipschitz(2, 5) = 0.61;
  Config config{.path = "bicycle", .says_between = true, .laws = laws};
  config.gate.step_error_ms = kAnyTime;
  config.problem = problem;
  config.obstacles = {Obstacle::Circle(Vec({25, 1}), 3), Obstacle::Circle(Vec({45, -4}), 3)};
  config.planner.goal = {65, 0};
  config.planner.goal_radius = 2;
  config.planner.braking = 2.6;
  config.planner.tail_steps = 60;
  config.planner.initial_half_width = {0.05, 0.05, 0.01, 0.03, 0.01, 0.002};
  config.robot.start = {0, 0, 0, 0, 0, 0};
  return config;
}

inline Config PointMass() {
  static const Laws laws = LawsOf("point_mass");
  auto problem = std::make_shared<Problem>(PaperPointMass(5.4, 2));
  problem->declaration.state_error = Vec({0, 0, 0, 0});
  problem->domain.balls = {{{2, 3}, Vec({0, 0}), 5.4}};
  Config config{.path = "point_mass", .says_between = true, .laws = laws};
  config.gate.step_error_ms = kAnyTime;
  config.problem = problem;
  config.obstacles = {Obstacle::Circle(Vec({5, 0.3}), 1.5)};
  config.planner.goal = {12, 0};
  config.planner.cruise_speed = 3;
  config.planner.braking = 1.5;
  config.planner.initial_half_width = {0.05, 0.05, 0.03, 0.03};
  config.robot.start = {0, 0, 0, 0};
  return config;
}

}  // namespace forereach
