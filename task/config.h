/** The content of a task file, and the CSV files of transitions and plans. The schema (schema.h) defines each key's
meaning, unit, range and default; config/README.md is generated from it. */
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus_options.h"
#include "bus/realtime.h"
#include "forereach/certify/problem.h"
#include "forereach/dynamics/parametric_residual.h"
#include "task/canonical.h"
#include "task/config_error.h"
#include "task/gate_options.h"
#include "task/keep_in.h"
#include "task/laws.h"
#include "task/logger_options.h"
#include "task/planner_options.h"
#include "task/robot_options.h"

namespace forereach {

class Document;

/** A checked task. Everything fits together: sizes, names, and all transitions lie in the domain. */
struct Config {
  std::string path;
  Grounds grounds;  ///< Before anything is heard or learned.
  std::shared_ptr<const Problem> problem;
  /** Of each of the problem's transitions: its row in the file, counted from 0. */
  std::vector<int> rows;
  /** How many transitions of the file are not the problem's: within the declared errors of states and inputs their z
  may lie outside the domain. The grounds name all. */
  int left_out = 0;
  std::string transitions;  ///< The path of that file; "data" if there is none.
  double period = 0;        ///< model.dt: from one sample to the next, s.
  /** Those of task.obstacles, and behind them what is outside of each area of keep_in. */
  std::vector<Obstacle> obstacles;
  std::size_t num_listed = 0;  ///< So many of them are of task.obstacles.
  std::vector<KeepIn> keep_in;
  Box initial_set;  ///< X0, rounded outward.
  /** False: the file has no task.between, and its certificates hold at the samples only. */
  bool says_between = false;
  std::optional<ParametricResidual> residual;  ///< What `forereach declare` bounds.
  /** What the simulated robot does beyond the nominal model, with exact parameters of its own. None: nothing. */
  std::optional<ParametricResidual> robot_residual;
  GateOptions gate;
  RealtimeOptions realtime;
  BusOptions bus;
  PlannerOptions planner;
  Laws laws;
  RobotOptions robot;
  LoggerOptions logger;
};

/** kIgnore: does not read the transitions that the task file names, for commands that will write them. */
enum class TransitionsFile { kRead, kIgnore };

/** Reads a task file and the transitions that it names. Cost: linear in the files.
@throws ConfigError with file, line, key, value and bound: a missing file, an unknown or missing key, a wrong size, a
number that is not finite or out of range, a transition outside the domain. */
[[nodiscard]] Config LoadConfig(const std::string& path, TransitionsFile transitions = TransitionsFile::kRead);

/** The same of a file whose caller asks it for the places of keys afterwards. */
[[nodiscard]] Config LoadConfig(Document& file, TransitionsFile transitions);

/** The paths of the data files of a task, which belong to the task but not to the bytes of its file. Empty if the task
file names no such file. A key file is not listed: it is a secret, not data. */
struct NamedFiles {
  std::string transitions, policy, model;
};

/** The files that a task file names, relative to its directory. @throws ConfigError if it is not a task file. */
[[nodiscard]] NamedFiles FilesNamedBy(const std::string& path);

/** As the other LoadConfig, but reads each nonempty file of `instead` in place of the one that the task file names.
@throws ConfigError as it does. */
[[nodiscard]] Config LoadConfig(const std::string& path, const NamedFiles& instead);

/** @name What LoadConfig does not require, because not every command needs it.
@throws ConfigError that says which line to add or to change. */
///@{
/** What a command needs before it certifies anew: the task has task.between, or is of the paper's method. */
void RequireForCertifying(const Config& config);
/** What a process needs before it certifies on a bus: the same, the task has gate.obstacles and, if a robot's state
arms the gate, declaration.state_error and robot.step_error_ms, and no obstacle of the file moves. A motion in a file
begins with the plan; on a bus `forereach obstacles` sends it with the time that it begins. */
void RequireForCertifyingOnBus(const Config& config);
///@}

/** The states that are zero while the robot stands, by their indices: those of robot.hold. @throws ConfigError if the
task does not say it. */
[[nodiscard]] std::vector<int> HeldStates(const Config& config);

/** Reads transitions from CSV (csv.h): columns for each state, input and successor `<state>_next`, in any order, in the
model's units, and perhaps `dt_error`: Transitions::longer, s. @throws ConfigError, also if there is no transition. */
[[nodiscard]] Transitions LoadTransitions(const std::string& path, const NominalModel& model);

/** Writes transitions so that LoadTransitions returns the same bits. @throws ConfigError. */
void SaveTransitions(const std::string& path, const NominalModel& model, const Transitions& transitions);

/** Reads a plan from CSV (csv.h): a column for each input, in any order, in the model's units; one row a step.
@return m-by-T, one column a step, inputs in the model's order. @throws ConfigError. */
[[nodiscard]] Eigen::MatrixXd LoadPlan(const std::string& path, const NominalModel& model);

/** Writes a plan so that LoadPlan returns the same bits. @throws ConfigError. */
void SavePlan(const std::string& path, const NominalModel& model, const Eigen::MatrixXd& controls);

}  // namespace forereach
