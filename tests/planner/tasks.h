/** Two small tasks for the planner's tests. Their laws are those of the tasks that drive these models. */
#pragma once

#include <initializer_list>
#include <memory>
#include <string>

#include "certifier/dynamics/models/named_models.h"
#include "certifier/task/config.h"
#include "tests/paths.h"

namespace forereach {

inline Eigen::VectorXd Vec(std::initializer_list<double> values) {
  return Eigen::Map<const Eigen::VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

inline Laws LawsOf(const std::string& drive) {
  return LoadConfig(FOREREACH_SOURCE_DIR "/config/drive/" + drive + ".yaml", TransitionsFile::kIgnore).laws;
}

inline Config Bicycle() {
  static const Laws laws = LawsOf("kinematic_bicycle");
  auto problem = std::make_shared<Problem>();
  problem->model = MakeKinematicBicycle(0.1, 2.5);
  problem->domain.state = Box(Vec({-10, -15, -3, -0.5, -3, -0.48}), Vec({80, 15, 3, 12, 3, 0.48}));
  problem->domain.input = Box(Vec({-10, -1}), Vec({10, 1}));
  problem->declaration.lipschitz = Eigen::MatrixXd::Zero(6, 8);
  problem->declaration.lipschitz(2, 3) = 0.018;
  problem->declaration.lipschitz(2, 5) = 0.61;
  problem->declaration.noise_bound = Eigen::VectorXd::Zero(6);
  problem->transitions = {Eigen::MatrixXd::Zero(1, 8), Eigen::MatrixXd::Zero(1, 6)};  // at rest it stays
  problem->projection = Eigen::MatrixXd::Identity(2, 6);
  Config config;
  config.path = "bicycle";
  config.laws = laws;
  config.says_between = true;
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
  auto problem = std::make_shared<Problem>();
  problem->model = MakePointMass(0.15);
  problem->domain.state = Box(Vec({-20, -20, -5.4, -5.4}), Vec({20, 20, 5.4, 5.4}));
  problem->domain.input = Box(Vec({-2, -2}), Vec({2, 2}));
  problem->domain.balls = {{{2, 3}, Vec({0, 0}), 5.4}};
  problem->declaration.lipschitz = Eigen::MatrixXd::Zero(4, 6);
  problem->declaration.noise_bound = Eigen::VectorXd::Zero(4);
  problem->transitions = {Eigen::MatrixXd::Zero(1, 6), Eigen::MatrixXd::Zero(1, 4)};
  problem->projection = Eigen::MatrixXd::Identity(2, 4);
  Config config;
  config.path = "point_mass";
  config.laws = laws;
  config.says_between = true;
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
