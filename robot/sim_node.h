/** The simulated robot: a Target that executes certified plans under the Supervisor, one step at a time.

Step boundaries lie at t_j = t_0 + j * step_period, t_0 being the first Tick. At each, in this order:
 1. the control of the step that has ended is applied to the target, and the supervisor finishes the step;
 2. CONTACT for every obstacle that contains the true state; GOAL_REACHED once, where |P x - goal| <= goal_radius first
    holds;
 3. the supervisor starts the pending plan, goes on with the current one or holds, and reports (supervisor.h).

While the robot holds, the speed and acceleration that were left are zero at once (v and a of the bicycle, vx and vy of
the point mass), every other coordinate keeps its value, and no control and no residual act until the next plan starts.
An emergency stop is the same hold, whatever the speed was.

The run ends after the goal is reached or the time limit has passed: no further plan starts, the current one runs to its
end, and once the robot holds it sends FINISHED for kFinishedBoundaries boundaries and is done.

Obstacles and start are those of the task file. After a reload it also takes plans that are certified under the file as
it is now (Guard::Expect); the robot and its world stay. */
#pragma once

#include <iostream>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bus/node.h"
#include "bus/reloading.h"
#include "certifier/task/config.h"
#include "robot/supervisor.h"
#include "robot/target.h"

namespace forereach {

class RobotSimNode final : public Node, private Supervisor::Robot {
 public:
  static constexpr int kFinishedBoundaries = 5;

  /** @param bus has to outlive the node, and hands out nothing after the node is gone.
  @param out gets the summary at Stop.
  @throws ConfigError if robot.start, planner.goal or the residual do not fit the model. */
  RobotSimNode(const Config& config, Bus& bus, std::ostream& out = std::cout);

  /** Handles every boundary up to `now_us`; a late call catches up, each boundary at its own time. */
  void Tick(std::int64_t now_us) override;
  [[nodiscard]] bool done() const override { return finished_boundaries_ >= kFinishedBoundaries; }
  /** Reads the task file, beside the running work. */
  void Reload() override;
  /** Prints Summary() on a line of its own. */
  void Stop() override;

  /** One JSON object: boundaries, steps_executed, steps_inside_slice, contacts, goal_reached, distance_to_goal (metres,
  now; null without a goal), stops (times it stood before the goal, emergencies included), plans_accepted,
  plans_started, plans_refused (count by GuardCauseName), messages_not_sent. */
  [[nodiscard]] std::string Summary() const;

  [[nodiscard]] std::span<const double> state() const override { return state_; }

 private:
  void Hold() override;
  void Send(const std::string& channel, Bytes message) override;
  void TakeReload();
  void Boundary(std::int64_t utime, std::int64_t now_us);
  void ReportContacts(std::int64_t utime);
  void ReportGoal(std::int64_t utime);
  void LogProgress(std::int64_t utime);
  [[nodiscard]] Eigen::VectorXd Position() const;
  [[nodiscard]] double DistanceToGoal() const;

  const Config config_;
  Sender sender_;
  std::ostream& out_;
  const std::unique_ptr<Target> target_;
  const std::int64_t period_us_;
  std::vector<int> rest_coordinates_;  // zero while standing
  Reloading<std::optional<Config>> reload_;

  std::vector<double> state_;
  std::optional<std::int64_t> start_utime_;
  std::int64_t next_progress_utime_ = 0;
  bool goal_reached_ = false;
  int finished_boundaries_ = 0;
  std::int64_t contacts_ = 0, stops_ = 0;

  Supervisor supervisor_;
};

}  // namespace forereach
