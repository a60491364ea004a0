// A planner: takes a point mass, as examples/python/rover.yaml has it, to a goal in certified plans that end at rest.
// It reads sizes, channels and key from the task file.   planner TASK X Y [KEYS [URL]]
#include <algorithm>
#include <iostream>
#include <random>

#include <Eigen/Geometry>
#include "clients/planner_client.h"

using Eigen::Vector2d;

constexpr int kHalf = 8;  // steps of speeding up, and as many of braking

// Pushes towards the goal, more or less, each with its braking tail: those that end nearest to it come first.
static std::vector<Eigen::MatrixXd> Sample(const Vector2d& from, const Vector2d& goal, double dt) {
  static std::mt19937 random(1);
  std::normal_distribution<double> aside(0, 0.9);
  std::uniform_real_distribution<double> part(0.2, 1);
  const Vector2d to_goal = goal - from, longest = to_goal.normalized() * std::min(to_goal.norm(), 0.4);
  std::vector<Vector2d> ways(16);
  for (Vector2d& way : ways) way = Eigen::Rotation2Dd(aside(random)) * longest * part(random);
  std::ranges::sort(ways, {}, [&](const Vector2d& way) { return (to_goal - way).norm(); });
  std::vector<Eigen::MatrixXd> plans;
  for (const Vector2d& way : ways) {
    const Vector2d push = way / (kHalf * dt * kHalf * dt);
    Eigen::MatrixXd& plan = plans.emplace_back(2, 2 * kHalf);
    plan << push.replicate(1, kHalf), -push.replicate(1, kHalf);
  }
  return plans;
}

int main(int argc, char** argv) try {
  const auto argument = [&](int k) { return argc > k ? argv[k] : ""; };
  forereach::PlannerClient planner({argument(1), argument(4), argument(5)}, "own_planner");
  const Vector2d goal(std::stod(argument(2)), std::stod(argument(3)));
  const Eigen::Vector4d half_width(0.02, 0.02, 0.01, 0.01);
  const std::int64_t step_us = planner.step_us();
  int certified = 0;
  for (std::int64_t busy_until = 0;;) {
    const auto state = planner.RobotState(30);
    if (!state) throw std::runtime_error("no robot is heard");
    if (state->mode != forereach::robot_state_t::STANDING || state->utime <= busy_until) continue;
    const Eigen::Vector4d x = Eigen::Map<const Eigen::Vector4d>(state->state);
    if ((goal - x.head<2>()).norm() < 0.1) break;
    const std::int64_t start = state->utime + 6 * step_us;
    const auto plans = Sample(x.head<2>(), goal, static_cast<double>(step_us) * 1e-6);
    planner.ProposeMany(plans, {start, x, half_width}, {.progress_steps = kHalf});
    for (const auto& decision : planner.Decisions(5)) {
      std::cout << forereach::GetText(decision.message) << std::endl;
      if (decision.outcome != forereach::decision_t::CERTIFIED) continue;
      ++certified;
      busy_until = start;
    }
  }
  std::cout << "at the goal after " << certified << " certified plans" << std::endl;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
