/** The simulated robot: a Target that executes certified plans through the Guard, one step at a time.

Step boundaries lie at t_j = t_0 + j * step_period, t_0 being the first Tick. At each, in this order:
 1. the control of the step just ended is applied to the target and published as transition_t, and the new state is
    checked against the slice of the executing plan: STEP_INSIDE, or STEP_OUTSIDE, which stops the robot;
 2. CONTACT for every obstacle the true state lies in; GOAL_REACHED once, where |P x - goal| <= goal_radius first holds;
 3. a pending plan whose start_utime is this boundary takes over, at any step of the current plan or while standing:
    STARTED. A plan that fails a check of the guard there is REFUSED and the current plan goes on;
 4. else the current plan goes on: TAIL_BEGUN where its braking tail begins, STANDING where it ends;
 5. robot_state_t says what is applied from t_j on.
So without a newer certificate the robot runs the tail it has already certified, stands, and goes on from there.

Standing is a hold mode of the simulated robot: the speed and acceleration that a finished tail leaves are set to
zero at once (v and a of the bicycle, vx and vy of the point mass), every other coordinate keeps its value, and no
control and no residual act until the next plan starts. An emergency stop (STEP_OUTSIDE, or HALTED when the certifier
says SLICE_LEFT or DECLARATION_FALSIFIED) enters the same mode, whatever the speed was: nothing certified is left to
execute. After it the robot stands until a reset on bus.channels.command.

The run ends after the goal is reached or the time limit has passed: no further plan starts, the current one runs to
its end, and once the robot stands it publishes FINISHED for kFinishedBoundaries boundaries and is done.

With keys (bus.key) the guard checks once more, by itself, that the certifier has signed a plan. Messages on
PLAN_CERTIFIED, FAULT and COMMAND are all it obeys. Obstacles and start are those of the task file. A reload makes it
take plans certified under the file as it is now (Guard::Expect); the robot and its world stay. */
#pragma once

#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus/node.h"
#include "certifier/task/config.h"
#include "certifier/task/reloading.h"
#include "forereach/execution_event_t.hpp"
#include "robot/guard.h"
#include "robot/target.h"

namespace forereach {

class RobotSimNode final : public Node {
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

  [[nodiscard]] const std::vector<double>& state() const { return state_; }

 private:
  void OnCertified(const Received& received);
  void OnFault(const Received& received);
  void OnCommand(const Received& received);
  void TakeReload();
  void Boundary(std::int64_t utime, std::int64_t now_us);
  void FinishStep(std::int64_t utime, std::int64_t now_us);
  void ReportContacts(std::int64_t utime);
  void ReportGoal(std::int64_t utime);
  void StartPending(std::int64_t utime, std::int64_t now_us);
  void ContinuePlan(std::int64_t utime);
  void Stand();
  void PublishState(std::int64_t utime);
  void LogProgress(std::int64_t utime);
  void PublishTransition(std::int64_t utime, std::span<const double> control, std::span<const double> next);
  void PublishRefusal(std::int64_t utime, const GuardVerdict& verdict);
  void PublishEvent(std::int64_t utime, std::int16_t kind, std::int64_t plan_id, int step, double value,
                    std::string_view text, int coordinate = -1);

  [[nodiscard]] Eigen::VectorXd Position() const;
  [[nodiscard]] double DistanceToGoal() const;
  [[nodiscard]] bool executing() const { return guard_.executing() != nullptr; }
  [[nodiscard]] std::int64_t executing_plan_id() const;
  [[nodiscard]] int executing_step() const { return executing() ? step_ : -1; }

  const Config config_;
  Sender sender_;
  std::ostream& out_;
  const std::unique_ptr<Target> target_;
  const std::int64_t period_us_;
  Guard guard_;
  std::vector<int> rest_coordinates_;  // zero while standing
  Reloading<std::optional<Config>> reload_;

  std::vector<double> state_;
  std::int64_t halted_utime_ = 0, reset_utime_ = 0;  // the last time: by a fault or the guard; by a person
  int step_ = 0;  // of the executing plan: the control applied from the last boundary on
  std::optional<std::int64_t> start_utime_;
  std::int64_t boundaries_ = 0, transitions_ = 0, events_ = 0;
  std::int64_t next_progress_utime_ = 0;
  bool goal_reached_ = false, ending_ = false;
  int finished_boundaries_ = 0;

  std::int64_t steps_inside_ = 0, contacts_ = 0, stops_ = 0, accepted_ = 0, started_ = 0;
  std::map<std::string, std::int64_t> refused_;
};

}  // namespace forereach
