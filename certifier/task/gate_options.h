/** What a task file says of the gate. */
#pragma once

#include <string>

namespace forereach {

/** Where the obstacles of a task are known from. */
enum class ObstaclesSource {
  kUnsaid,  ///< Tasks from before gate.obstacles: the file's, until some are heard. Read to replay old logs.
  kBus,     ///< The file's and those that OBSTACLES carries; nothing is certified while no sender is heard.
  kTask,    ///< The file's alone.
};

struct GateOptions {
  double max_age_ms = 500;
  double max_ahead_ms = 50;
  double certificate_lifetime_ms = 2000;
  double decision_budget_ms = 5;  ///< A candidate that starts sooner is answered ABSTAIN_DEADLINE.
  int queue = 64;
  bool shadow = false;             ///< Decide, and pass nothing on.
  bool needs_robot_state = true;   ///< Certify only while the robot's state is heard.
  double robot_timeout_ms = 1000;  ///< The robot's state counts as lost after this time without one.
  double max_clock_jump_ms = 200;
  ObstaclesSource obstacles = ObstaclesSource::kUnsaid;
  double obstacles_timeout_ms = 1000;  ///< The obstacles heard on the bus are no longer known after this time.
  bool learns = true;                  ///< Executed transitions add to the observations.
  std::string state = "state";         ///< Directory that keeps a latched fault over a restart.
  double longest_step_ms = 150;  ///< No step of a plan takes longer. From a file: the model's dt or the robot's period.
};

}  // namespace forereach
