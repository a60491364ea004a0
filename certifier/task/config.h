/** A task file, read whole: all a robot needs. What each key means, its unit, range and default stand in schema.cpp
and, made from it, in config/README.md. */
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/authentic.h"
#include "certifier/certify/problem.h"
#include "certifier/dynamics/parametric_residual.h"
#include "certifier/task/canonical.h"
#include "lcmtypes/bad_input.h"
#include "lcmtypes/codec.h"

namespace forereach {

/** A file that a person wrote: the text names file, line, key, value and bound. */
class ConfigError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** Where the obstacles of a task are known from. */
enum class ObstaclesSource {
  kUnsaid,  ///< Tasks from before gate.obstacles: the file's, until some are heard. Read to replay old logs.
  kBus,     ///< The file's and, besides, those that OBSTACLES says; nothing is certified while it says none.
  kTask,    ///< The file's alone.
};

struct GateOptions {
  double max_age_ms = 500;
  double max_ahead_ms = 50;
  double certificate_lifetime_ms = 2000;
  double decision_budget_ms = 5;  ///< A candidate that starts sooner is abstained from.
  int queue = 64;
  bool shadow = false;             ///< Decide, and pass nothing on.
  bool needs_robot_state = true;   ///< Certify only while the robot's state is heard.
  double robot_timeout_ms = 1000;  ///< It counts as lost after this.
  double max_clock_jump_ms = 200;
  ObstaclesSource obstacles = ObstaclesSource::kUnsaid;
  double obstacles_timeout_ms = 1000;  ///< Those heard on the bus are no longer known after this.
  bool learns = true;                  ///< Executed transitions add to the observations.
  std::string state = "state";         ///< Directory that keeps a latched fault over a restart.
  double longest_step_ms = 150;  ///< No step of a plan takes longer. From a file: the model's dt or the robot's period.
};

/** What the operating system is asked for, so that nothing keeps the certifier waiting. */
struct RealtimeOptions {
  enum class Lock { kNo, kTry, kRequire };
  Lock lock_memory = Lock::kTry;
  int fifo_priority = 0;  ///< SCHED_FIFO, 1..99; 0 leaves the scheduler alone.

  friend bool operator==(const RealtimeOptions&, const RealtimeOptions&) = default;
};

struct BusOptions {
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  std::string candidate = "PLAN_CANDIDATE";
  std::string decision = "PLAN_DECISION";
  std::string certified = "PLAN_CERTIFIED";
  std::string robot_state = "ROBOT_STATE";
  std::string obstacles = "OBSTACLES";
  std::string transition = "TRANSITION";
  std::string status = "CERTIFIER_STATUS";
  std::string event = "EXECUTION_EVENT";
  std::string logger_status = "LOGGER_STATUS";
  std::string fault = "FAULT";
  std::string command = "COMMAND";
  std::string name;             ///< Of the bus, in every signature; empty: default_name().
  std::string key;              ///< Path of a directory of keys or of a key file; empty: messages are not signed.
  bool key_is_given = false;    ///< On the command line, so the task file does not say which.
  std::optional<KeyRing> keys;  ///< What `key` held when the process started; nothing: not read yet, or none.

  /** Who speaks on which channel where there are keys. */
  [[nodiscard]] Speakers speakers() const {
    return {{decision, Role::kCertifier}, {certified, Role::kCertifier}, {status, Role::kCertifier},
            {fault, Role::kCertifier},    {candidate, Role::kPlanner},   {obstacles, Role::kPerception},
            {robot_state, Role::kRobot},  {transition, Role::kRobot},    {event, Role::kRobot},
            {command, Role::kOperator},   {logger_status, Role::kLogger}};
  }

  /** `name`, or address and port of `url`: "239.255.76.67:7667"; "memq" for memq. @throws BusError if `url` is none. */
  [[nodiscard]] std::string bus_name() const;

  friend bool operator==(const BusOptions&, const BusOptions&) = default;
};

struct PlannerOptions {
  std::string source = "ompl";  ///< Or policy.
  std::string policy;           ///< Its file; from a task file always there if the source is policy.
  std::string algorithm = "kpiece";
  std::vector<double> goal;     ///< In the safety coordinates, metres.
  double goal_radius = 1.0;     ///< Metres.
  double clearance = 0.3;       ///< Obstacles are inflated by this for planning, metres.
  double clearance_step = 0.1;  ///< Added after each abstention S of one planning round, metres.
  int progress_steps = 8;       ///< Controls before the braking tail.
  int tail_steps = 40;          ///< Longest braking tail.
  int lead_steps = 2;           ///< A candidate starts this many steps after the state it was planned from.
  int candidates = 12;          ///< Candidates for one start at most.
  double cruise_speed = 8;      ///< m/s
  double braking = 2.5;         ///< m/s^2
  double time_limit_ms = 15;    ///< For one OMPL query.
  int seed = 1;
  std::vector<double> initial_half_width;  ///< X0 of each candidate, per state; from a file always as many.
};

struct RobotOptions {
  std::vector<double> start;      ///< State, model units; from a file always as many as states.
  double step_period_ms = 40;     ///< Wall-clock time of one model step.
  double time_limit_s = 40;       ///< The run ends then, goal or not.
  std::string residual = "none";  ///< How the real robot differs: none, heading_saturation, velocity_knee.
  std::map<std::string, double> residual_parameters;  ///< From a file all of them, with the model's dt and wheelbase.
};

struct LoggerOptions {
  std::string directory = "log";
  int queue = 4096;                ///< Messages held for writing at most.
  double flush_ms = 200;           ///< A killed logger loses at most this much.
  double rotate_mb = 1024;         ///< Most of one log file; 10^6 bytes each.
  double rotate_minutes = 60;      ///< Longest time in one log file.
  std::optional<double> quota_mb;  ///< Most of all log files together; nothing: none is ever deleted.
  double min_free_mb = 256;        ///< With less free on the disk recording pauses.
  double unsigned_kb_per_s = 100;  ///< With keys, most of what nobody signed that is recorded; 10^3 bytes each.
};

struct Config {
  std::string path;
  Digest digest{};  ///< Of the file's bytes.
  Digest model_digest{}, declaration_digest{}, observations_digest{};
  std::shared_ptr<const Problem> problem;
  std::vector<Obstacle> obstacles;
  Digest obstacles_digest{};
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
