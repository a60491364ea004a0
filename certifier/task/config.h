/** A task file, read whole: all a robot needs. What each key means, its unit, range and default stand in schema.cpp
and, made from it, in config/README.md. */
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus_options.h"
#include "bus/realtime.h"
#include "certifier/certify/problem.h"
#include "certifier/dynamics/parametric_residual.h"
#include "certifier/task/canonical.h"
#include "certifier/task/config_error.h"
#include "certifier/task/gate_options.h"
#include "logger/logger_options.h"
#include "planner_bridge/planner_options.h"
#include "robot/robot_options.h"

namespace forereach {

struct Config {
  std::string path;
  Grounds grounds;  ///< Before anything is heard or learned.
  std::shared_ptr<const Problem> problem;
  std::vector<Obstacle> obstacles;
  Box initial_set;                             ///< X0, rounded outward.
  std::optional<ParametricResidual> residual;  ///< What `forereach declare` bounds; dt and wheelbase are the model's.
  GateOptions gate;
  RealtimeOptions realtime;
  BusOptions bus;
  PlannerOptions planner;
  RobotOptions robot;
  LoggerOptions logger;
};

/** Whether the transitions a task file names are read; not, where they are still to be made. */
enum class TransitionsFile { kRead, kIgnore };

/** Reads a task file and the transitions it names.
@throws ConfigError for a missing file, an unknown or missing key, a wrong size, a non-finite or out-of-range number. */
[[nodiscard]] Config LoadConfig(const std::string& path, TransitionsFile transitions = TransitionsFile::kRead);

/** Paths of the data that belongs to the task, but not to the file's own bytes. Empty: the task names none. A key file
is none of these: it is a secret. */
struct NamedFiles {
  std::string transitions, policy;
};

/** The files that a task file names, relative to the task file's place. @throws ConfigError if it is no task file. */
[[nodiscard]] NamedFiles FilesNamedBy(const std::string& path);

/** The same as the other LoadConfig, but reads the files of `instead` in place of those that the task file names. An
empty entry of `instead` replaces nothing. @throws ConfigError as the other. */
[[nodiscard]] Config LoadConfig(const std::string& path, const NamedFiles& instead);

/** @throws ConfigError, which says what to write, where the task does not say gate.obstacles: whoever certifies on a
bus needs to know where its obstacles come from. */
void RequireObstaclesSource(const Config& config);

/** Reads transitions: CSV with a column for each state, each input and each state's successor `<state>_next`, in any
order, one row a transition. @throws ConfigError, also if there is none. */
[[nodiscard]] Transitions LoadTransitions(const std::string& path, const NominalModel& model);

/** Writes transitions so that LoadTransitions gives them back to the last bit. @throws ConfigError. */
void SaveTransitions(const std::string& path, const NominalModel& model, const Transitions& transitions);

/** Reads a plan: CSV with a header that names the inputs in any order, one row a step.
@return one column a step, inputs in the model's order. @throws ConfigError. */
[[nodiscard]] Eigen::MatrixXd LoadPlan(const std::string& path, const NominalModel& model);

/** Writes a plan so that LoadPlan gives it back to the last bit. @throws ConfigError. */
void SavePlan(const std::string& path, const NominalModel& model, const Eigen::MatrixXd& controls);

}  // namespace forereach
