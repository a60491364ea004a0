/** The options of the gate, from `gate` in a task file. Times in milliseconds. */
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

namespace forereach {

/** The source of a task's obstacles. */
enum class ObstaclesSource {
  kUnsaid,  ///< The file's only. No certifier starts on a bus.
  kBus,     ///< The file's and those on OBSTACLES. Nothing is certified while no sender is heard.
  kTask,    ///< The file's only.
};

/** A value of GateOptions::obstacles_lost_ms. */
inline constexpr double kNeverLost = std::numeric_limits<double>::infinity();

/** A value of GateOptions::step_error_ms. */
inline constexpr double kAnyTime = std::numeric_limits<double>::infinity();

struct GateOptions {
  double max_age_ms = 500;
  double max_ahead_ms = 50;
  double certificate_lifetime_ms = 2000;
  double decision_budget_ms = 5;  ///< A candidate that starts sooner is answered ABSTAIN_DEADLINE.
  int max_pieces = 1;             ///< Of X_0, where its tube is too wide (forereach/certify/pieces.h); 1: it is whole.
  int queue = 64;
  bool shadow = false;             ///< Decides, but sends no certified plan.
  bool advises = false;            ///< Says after an abstention what would have helped.
  bool needs_robot_state = true;   ///< Certifies only while the robot's state is heard.
  double robot_timeout_ms = 1000;  ///< The robot's state is lost after this time without a message.
  double max_clock_jump_ms = 200;
  /** How far the clocks of robot and obstacles' sender may differ. Without it no obstacle may move. Stamps of states
  and obstacles are held to it at their arrival (gate/stream_clock.h). */
  std::optional<double> max_clock_error_ms;
  /** How far the boundary of a step may be from its time, on the robot's clock: from the plan's start and from the
  first step's. kAnyTime: steps are taken at any time. Nothing: not said; no certifier whose robot arms it starts. The
  key is robot.step_error_ms. */
  std::optional<double> step_error_ms;
  ObstaclesSource obstacles = ObstaclesSource::kUnsaid;
  double obstacles_timeout_ms = 1000;  ///< The obstacles of the bus are unknown after this time without a message.
  /** Plans under way are withdrawn once the obstacles of the bus have been unknown for so long; kNeverLost: never.
  Nothing: not said; no certifier starts with the obstacles of the bus. */
  std::optional<double> obstacles_lost_ms;
  bool learns = true;           ///< Adds executed transitions to the observations.
  std::string state = "state";  ///< The directory that keeps a latched fault across restarts.
  /** step_us of every candidate: model.dt, where a certificate rests on when steps are. 0: any. */
  std::int64_t step_us = 0;
  double longest_step_ms = 150;  ///< An upper bound on a step. The larger of the model's dt and robot.step_period_ms.
};

}  // namespace forereach
