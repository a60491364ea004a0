// The mower's planner: arcs that end at rest, those nearest to the goal first.   planner TASK X Y [KEYS [URL]]
#include <algorithm>
#include <cmath>
#include <iostream>

#include "clients/planner_client.h"

using Eigen::MatrixXd, Eigen::Vector2d, Eigen::VectorXd;

constexpr int kDrive = 12, kStop = 20, kMost = 24;  // steps; plans in one message

// How far a plan leaves the mower from the goal, by the task's model: metres, and what it has to turn there.
static double Left(const forereach::NominalModel& model, VectorXd x, const MatrixXd& plan, const Vector2d& goal) {
  for (const auto& u : plan.colwise()) {
    const Eigen::Vector<double, 7> z = (Eigen::Vector<double, 7>() << x, u).finished();
    model.Evaluate({z.data(), 7}, {x.data(), static_cast<std::size_t>(x.size())});
  }
  const Vector2d way = goal - x.head<2>();
  return way.norm() + 0.3 * std::abs(std::remainder(std::atan2(way.y(), way.x()) - x[2], 2 * M_PI));
}

static std::vector<MatrixXd> Arcs(const forereach::NominalModel& model, const VectorXd& x, const Vector2d& goal) {
  std::vector<std::pair<double, MatrixXd>> arcs;
  for (const double speed : {0.0, 0.15, 0.3, 0.4})
    for (int turn = -7; turn <= 7; ++turn) {
      MatrixXd plan = MatrixXd::Zero(2, kDrive + kStop);
      plan.leftCols(kDrive).colwise() = Vector2d(speed, 0.9 / 7 * turn);
      arcs.emplace_back(Left(model, x, plan, goal), std::move(plan));
    }
  std::ranges::sort(arcs, {}, &std::pair<double, MatrixXd>::first);
  std::vector<MatrixXd> nearest;
  for (int k = 0; k < kMost; ++k) nearest.push_back(std::move(arcs[static_cast<std::size_t>(k)].second));
  return nearest;
}

int main(int argc, char** argv) try {
  const auto argument = [&](int k) { return argc > k ? argv[k] : ""; };
  forereach::PlannerClient planner({argument(1), argument(4), argument(5)}, "mower");
  const Vector2d goal(std::stod(argument(2)), std::stod(argument(3)));
  const VectorXd half_width = (VectorXd(5) << 0.02, 0.02, 0.02, 0.01, 0.01).finished();
  int certified = 0;
  for (std::int64_t busy_until = 0;;) {
    const auto state = planner.RobotState(30);
    if (!state) throw std::runtime_error("no robot is heard");
    if (state->mode != forereach::robot_state_t::STANDING || state->utime <= busy_until) continue;
    const VectorXd x = Eigen::Map<const VectorXd>(state->state, 5);
    if ((goal - x.head<2>()).norm() < 0.3) break;
    const std::int64_t start = state->utime + 5 * planner.step_us();
    planner.ProposeMany(Arcs(*planner.problem().model, x, goal), {start, x, half_width}, {.progress_steps = kDrive});
    for (const auto& decision : planner.Decisions(5)) {
      std::cout << forereach::GetText(decision.message) << std::endl;
      if (decision.outcome == forereach::decision_t::CERTIFIED) ++certified, busy_until = start;
    }
  }
  std::cout << "at the goal after " << certified << " certified plans" << std::endl;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
