/** The simulated robot: a Plant that executes certified plans under the Supervisor, one step at a time.

Step boundaries are due at t_j = t_0 + j * step_period, where t_0 is the first Tick, and come as early or late as
robot.step_jitter says (step_jitter.h); messages carry the times at which they are due. Where the task has
robot.step_error_ms, a step lasts as long as the clock says; otherwise step_period. At each boundary, in this order:
 1. The plant takes the control of the step that has ended, with an error by robot.input_error, is disturbed
    (disturbance.h), its angles (model.angles) are turned into [-pi, pi], its state is measured, with an error by
    robot.sensor_error, and the supervisor finishes the step. All that supervisor and bus see is the measured state and
    the plan's control.
 2. The node reports CONTACT for every obstacle that the body has met since the last boundary (contacts.h),
    LIMIT_EXCEEDED for every limit of the task that does not hold at this boundary or, if it uses an input, with the
    control of the step that has ended, and GOAL_REACHED at the first boundary with |P x - goal| <= goal_radius.
 3. The supervisor starts the pending plan, continues the current one, or holds; then it reports (supervisor.h).

While the robot holds, the states of robot.hold are zero: by default those of task.rest, or those at which a compiled
model stands. Every other coordinate keeps its value, and no control, residual or disturbance acts until the next plan
starts.
It comes to rest as robot.emergency_stop says, at the end of a plan and in an emergency: the states that are named there
fall at exactly their rates, and the others of robot.hold are zero at once. Until all are zero the plant moves on with
inputs of zero, or the nearest to it in the domain, and is disturbed. Of the step in which the stop begins only the part
after that counts. Without robot.emergency_stop it stands at once, at any speed.

The run ends when the goal is reached or the time limit has passed. Then no further plan starts, and the current one
runs to its end. Once the robot holds, it sends FINISHED for kFinishedBoundaries boundaries and is done.

The start is that of the task file. The obstacles are those that are in force for a certifier of this task
(obstacles_in_force.h), known or not: while OBSTACLES is silent, the last ones stay. After a reload the robot also
accepts plans that are certified under the new file (Guard::Expect); its state and the file's obstacles do not change.
*/
#pragma once

#include <iostream>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bus/node.h"
#include "bus/reloading.h"
#include "certifier/gate/obstacles_in_force.h"
#include "forereach/safety/limit_values.h"
#include "robot/brake.h"
#include "robot/supervisor.h"
#include "simulator/contacts.h"
#include "simulator/disturbance.h"
#include "simulator/step_jitter.h"
#include "simulator/target.h"
#include "task/config.h"

namespace forereach {

class RobotSimNode final : public Node, private Supervisor::Robot {
 public:
  static constexpr int kFinishedBoundaries = 5;

  /** @param bus must outlive the node and must not call it after its end. @param out receives the summary at Stop.
  @param plant what moves the robot; empty: the task's target (MakeTarget).
  @throws ConfigError if robot.start, planner.goal or the residual do not fit the model. */
  RobotSimNode(const Config& config, Bus& bus, std::ostream& out = std::cout, Plant plant = {});

  /** Handles every boundary up to `now_us`, microseconds since the Unix epoch. After a late call, each boundary keeps
  its own time. */
  void Tick(std::int64_t now_us) override;
  /** The earliest time at which Tick handles the next boundary, once it has handled one. */
  [[nodiscard]] std::int64_t due_us() const;
  [[nodiscard]] bool done() const override { return finished_boundaries_ >= kFinishedBoundaries; }
  /** Reads the task file in the background. */
  void Reload() override;
  /** Prints Summary() as one line. */
  void Stop() override;

  /** One JSON object: boundaries, steps_executed, steps_inside_slice, steps_consistent (with their slice, within the
  state error), contacts, limits_exceeded (counted at each boundary), goal_reached, distance_to_goal (current, in
  metres; null without a goal), stops (before the goal, emergency stops included), emergency_stops (for a withdrawal),
  plans_accepted, plans_started, plans_refused (count by GuardCauseName), messages_not_sent.
  If many plans are refused at their start, since the robot is outside their X0, it logs so once, with the key. */
  [[nodiscard]] std::string Summary() const;

  /** As it was measured last. */
  [[nodiscard]] std::span<const double> state() const override { return measured_; }

 private:
  void MeasureState();
  void Hold() override;
  [[nodiscard]] int StepsToRest(std::span<const double> lower, std::span<const double> upper) const override {
    return brake_.StepsToRest(lower, upper);
  }
  void Send(const std::string& channel, Bytes message) override;
  void TakeReload();
  void Boundary(std::int64_t utime, std::int64_t now_us);
  void BrakeUntil(std::int64_t utime);
  void ReportContacts(std::int64_t utime, bool moved);
  [[nodiscard]] std::vector<double> LimitRoom(std::span<const double> control) const;
  void ReportLimits(std::int64_t utime, std::span<const double> room);
  [[nodiscard]] std::vector<Contact> Contacts(std::int64_t utime, bool moved) const;
  void OnObstacles(const Received& received);
  void ReportGoal(std::int64_t utime);
  void LogRefusedStarts();
  void LogProgress(std::int64_t utime);
  [[nodiscard]] Eigen::VectorXd Position() const;
  [[nodiscard]] double DistanceToGoal() const;

  const Config config_;
  Bus& bus_;
  std::ostream& out_;
  const Plant plant_;
  const BodyPlaces places_;
  const LimitValues limits_;
  Disturbance disturbance_, sensor_, inputs_;
  StepJitter jitter_;
  const std::int64_t period_us_;
  const std::int64_t most_late_us_;  // by which the plant knows of it; 0: the task looks at no clock
  const Brake brake_;
  Reloading<std::optional<Config>> reload_;

  ObstaclesInForce obstacles_;
  std::vector<double> state_, measured_;  // the true one, and what the robot takes for it
  std::vector<double> state_before_;      // at the last boundary; empty before the first
  std::optional<std::int64_t> start_utime_;
  std::int64_t offset_us_ = 0;       // of the next boundary
  std::int64_t late_before_us_ = 0;  // at the last one
  std::int64_t next_progress_utime_ = 0;
  std::string last_refusal_;  // of a plan at its start, since the state was outside its X0
  bool said_refusals_ = false;
  bool is_stopping_ = false;
  std::int64_t heard_utime_ = 0;  // of the message or boundary that is being handled
  std::int64_t brakes_since_utime_ = 0;
  bool goal_reached_ = false;
  int finished_boundaries_ = 0;
  std::int64_t contacts_ = 0, limits_exceeded_ = 0, stops_ = 0;

  Supervisor supervisor_;
};

}  // namespace forereach
