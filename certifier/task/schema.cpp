#include "certifier/task/schema.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "certifier/numerics/limits.h"
#include "certifier/numerics/text.h"
#include "certifier/task/config.h"

namespace forereach {
namespace {

using Type = Key::Type;
using Size = Key::Size;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr Range kReal{-kInf, kInf};
constexpr Range kNotNegative{0, kInf, false, true};
constexpr Range kPositive{0, kInf};
constexpr Range UpTo(double upper) { return {0, upper, true, false}; }
constexpr Range Between(double lower, double upper) { return {lower, upper, false, false}; }

constexpr double kHourMs = 3.6e6;
constexpr double kMaxMegabytes = 1e9;

// Keys without a default here are required where their map is there.
Key Required(Key key) {
  key.required = true;
  return key;
}

Key Optional(Key key, std::string fallback) {
  key.fallback = std::move(fallback);
  return key;
}

Key OnlyFor(std::string name, Key key) {
  key.only = std::move(name);
  return key;
}

Key Map(std::string path, std::string meaning) {
  return {.path = std::move(path),
          .type = Type::kMap,
          .unit = "",
          .range = kReal,
          .count = kReal,
          .words = {},
          .only = "",
          .fallback = "",
          .meaning = std::move(meaning)};
}

Key Of(Type type, std::string path, std::string unit, Range range, std::string meaning) {
  Key key = Map(std::move(path), std::move(meaning));
  key.type = type;
  key.unit = std::move(unit);
  key.range = range;
  return key;
}

Key Number(std::string path, std::string unit, Range range, std::string meaning) {
  return Of(Type::kNumber, std::move(path), std::move(unit), range, std::move(meaning));
}

Key Number(std::string path, std::string unit, Range range, double fallback, std::string meaning) {
  return Optional(Number(std::move(path), std::move(unit), range, std::move(meaning)), ToText(fallback));
}

Key Integer(std::string path, Range range, int fallback, std::string meaning) {
  return Optional(Of(Type::kInteger, std::move(path), "", range, std::move(meaning)), std::to_string(fallback));
}

Key Vector(std::string path, std::string unit, Range range, Size size, std::string meaning) {
  Key key = Of(Type::kVector, std::move(path), std::move(unit), range, std::move(meaning));
  key.size = size;
  if (size == Size::kAny) key.count = Between(1, kMaxVariables);
  return key;
}

Key Vectors(std::string path, std::string unit, Range range, Range count, Size size, std::string meaning) {
  Key key = Of(Type::kVectors, std::move(path), std::move(unit), range, std::move(meaning));
  key.count = count;
  key.size = size;
  return key;
}

Key Names(std::string path, Range count, Size size, std::string meaning) {
  Key key = Of(Type::kNames, std::move(path), "", kReal, std::move(meaning));
  key.count = count;
  key.size = size;
  return key;
}

Key List(std::string path, Range count, std::string meaning) {
  Key key = Of(Type::kList, std::move(path), "", kReal, std::move(meaning));
  key.count = count;
  return key;
}

Key Word(std::string path, std::vector<std::string_view> words, std::string meaning) {
  Key key = Of(Type::kWord, std::move(path), "", kReal, std::move(meaning));
  key.words = std::move(words);
  return key;
}

Key Text(std::string path, std::string meaning) {
  return Of(Type::kText, std::move(path), "", kReal, std::move(meaning));
}

Key Channel(std::string name, std::string fallback, std::string meaning) {
  return Optional(Of(Type::kChannel, "bus.channels." + name, "", kReal, std::move(meaning)), std::move(fallback));
}

// The parameters of the residuals (dynamics/residuals.h), in the map `path`.
std::vector<Key> ParameterKeys(const std::string& path) {
  const auto heading = [&](const char* name, std::string unit, Range range, double fallback, std::string meaning) {
    return OnlyFor("heading_saturation",
                   Number(path + "." + name, std::move(unit), range, fallback, std::move(meaning)));
  };
  const auto knee = [&](const char* name, std::string unit, Range range, double fallback, std::string meaning) {
    return OnlyFor("velocity_knee", Number(path + "." + name, std::move(unit), range, fallback, std::move(meaning)));
  };
  return {
      heading("understeer", "", kReal, 0.32, "Fraction of the heading rate lost in full saturation."),
      heading("friction", "", kNotNegative, 0.9, "Friction coefficient; saturation sets in at friction times gravity."),
      heading("gravity", "m/s^2", kPositive, 9.81, "Gravity."),
      heading("gate_temperature", "s^2/m", kPositive, 0.1, "How fast it sets in."),
      knee("damping", "1/s", kReal, 0.4, "Drag along the velocity."),
      knee("cross", "1/s", kReal, 0.3, "Force across the velocity."),
      knee("knee", "m/s", kNotNegative, 0.9, "The speed above which they act."),
      knee("softplus_temperature", "m/s", kPositive, 0.14, "How fast they set in."),
      knee("regularizer", "m/s", kPositive, 0.15, "Keeps the gain finite at rest."),
      knee("smoothing", "m^2/s^2", kPositive, 1e-12, "Makes the speed differentiable at rest."),
  };
}

std::vector<Key> ModelKeys() {
  return {
      Required(Map("model", "The nominal model f0.")),
      Required(Word("model.name", {"kinematic_bicycle", "point_mass"}, "Which equations.")),
      Required(Number("model.dt", "s", UpTo(60), "The time from one control to the next.")),
      OnlyFor("kinematic_bicycle", Required(Number("model.wheelbase", "m", UpTo(1000), "Distance between the axles."))),
  };
}

std::vector<Key> DomainKeys() {
  return {
      Required(
          Map("domain", "Z_cert, where declaration and model hold. A plan whose tube leaves it is not certified.")),
      Required(Map("domain.state", "The box of states.")),
      Required(Vector("domain.state.lower", "of the state", kReal, Size::kStates, "Least value of each state.")),
      Required(
          Vector("domain.state.upper", "of the state", kReal, Size::kStates, "Largest value, at least the least.")),
      Required(Map("domain.input", "The box of inputs.")),
      Required(Vector("domain.input.lower", "of the input", kReal, Size::kInputs, "Least value of each input.")),
      Required(
          Vector("domain.input.upper", "of the input", kReal, Size::kInputs, "Largest value, at least the least.")),
      Optional(List("domain.balls", Between(0, 1000),
                    "Further bounds: the Euclidean distance of some coordinates from a center."),
               "[]"),
      Map("domain.balls[]", "One ball."),
      Required(Names("domain.balls[].coordinates", Between(1, kMaxVariables), Size::kVariables,
                     "The coordinates it bounds.")),
      Required(
          Vector("domain.balls[].center", "of the coordinates", kReal, Size::kAny, "One entry for each coordinate.")),
      Required(Number("domain.balls[].radius", "of the coordinates", kNotNegative, "The largest distance.")),
      Optional(List("domain.inequalities", Between(0, 1000), "Further bounds: a weighted sum of coordinates."), "[]"),
      Map("domain.inequalities[]", "One inequality: sum of coefficient times coordinate <= bound."),
      Required(Map("domain.inequalities[].coefficients", "By name; the others are zero, not all may be.")),
      Number("domain.inequalities[].coefficients.<variable>", "", kReal, "The coefficient of this coordinate."),
      Required(Number("domain.inequalities[].bound", "of the sum", kReal, "The largest admissible value of the sum.")),
  };
}

std::vector<Key> DeclarationKeys() {
  return {
      Required(Map("declaration", "What is known of the residual besides the transitions.")),
      Required(Map("declaration.lipschitz",
                   "L by names: |r_k(z) - r_k(z')| <= sum over l of L_kl |z_l - z'_l|. What is not named is zero.")),
      Map("declaration.lipschitz.<state>", "Row k: the residual of this state."),
      Number("declaration.lipschitz.<state>.<variable>", "of the state per that of the coordinate", kNotNegative,
             "L_kl: how fast it may change with this coordinate."),
      Required(Vectors("declaration.lipschitz", "of the state per that of the coordinate", kNotNegative,
                       Between(1, kMaxStates), Size::kVariables,
                       "L as a matrix: one row for each state, one entry for each state and input.")),
      Required(Vector("declaration.noise_bound", "of the state", kNotNegative, Size::kStates,
                      "sigma: the largest error of a recorded successor, beyond its last bit.")),
      Required(Text("transitions",
                    "CSV of observed one-step transitions, relative to this file: a column for each state, "
                    "each input and each `<state>_next`, all inside the domain, at least one row.")),
  };
}

std::vector<Key> TaskKeys() {
  return {
      Required(Map("task", "What is to be certified.")),
      Required(Map("task.initial_set", "X0, the states a plan may start from. A candidate on the bus brings its own.")),
      Required(Vector("task.initial_set.center", "of the state", kReal, Size::kStates, "Its middle.")),
      Required(Vector("task.initial_set.half_width", "of the state", kNotNegative, Size::kStates, "Half its width.")),
      Map("task.rest",
          "What standing is: the absolute value of each state named here is at most its bound. A plan that may "
          "end otherwise is abstained from (D, no_stop), unless gate.require_stop is false."),
      Number("task.rest.<state>", "of the state", kNotNegative,
             "Its bound, on all of the last slice: small enough that the robot's hold mode takes up the rest."),
      Required(Names("task.projection", Between(1, kMaxSafetyDim), Size::kStates,
                     "P: the 1 to 3 states that obstacles are given in, in metres.")),
      Required(Vectors("task.projection", "", kReal, Between(1, kMaxSafetyDim), Size::kStates,
                       "P as a matrix: 1 to 3 rows, one entry for each state.")),
      Required(
          List("task.obstacles", Between(0, kMaxObstacles),
               "The unsafe sets, closed. `[]` for none. With `gate.obstacles: bus` those on the bus count besides.")),
      Map("task.obstacles[]", "One of circle, box, polygon and half_plane."),
      Map("task.obstacles[].circle", "A disc; the projection has to have 2 rows."),
      Required(Vector("task.obstacles[].circle.center", "m", kReal, Size::kSafety, "Its center.")),
      Required(Number("task.obstacles[].circle.radius", "m", kNotNegative, "Its radius.")),
      Map("task.obstacles[].box", "An axis-aligned box."),
      Required(Vector("task.obstacles[].box.lower", "m", kReal, Size::kSafety, "Its least corner.")),
      Required(Vector("task.obstacles[].box.upper", "m", kReal, Size::kSafety, "Its largest corner.")),
      Map("task.obstacles[].polygon", "The convex hull of points; the projection has to have 2 rows."),
      Required(Vectors("task.obstacles[].polygon.vertices", "m", kReal, Between(3, kMaxObstaclePoints), Size::kSafety,
                       "The points, in any order.")),
      Map("task.obstacles[].half_plane", "A half-space: unsafe where normal . y >= offset."),
      Required(Vector("task.obstacles[].half_plane.normal", "", kReal, Size::kSafety,
                      "Points into the unsafe side; not zero.")),
      Required(Number("task.obstacles[].half_plane.offset", "m", kReal, "In metres if the normal has length 1.")),
  };
}

std::vector<Key> CertifierKeys() {
  const GateOptions gate;
  return {
      Optional(Map("certifier", "How it certifies."), "all defaults"),
      Optional(
          Word("certifier.method", {"centred", "paper"},
               "paper: Algorithm 1 of the paper, with this project's conventions, unchanged for good. centred: the "
               "same with a tighter bound on the nominal model's remainder."),
          "centred"),
      Integer("certifier.zonotope_order", Between(1, kMaxGenerators), Problem{}.zonotope_order,
              "rho: a slice has at most rho generators a state. (rho + 2) times the number of states may not exceed " +
                  std::to_string(kMaxGenerators) + "."),
      Integer(
          "certifier.max_leaf_visits", Between(1, 1 << 20), Problem{}.max_leaf_visits,
          "Groups of 32 observations that one search for the tightest may look at. Any of them give a sound bound; a "
          "decision whose search met this cap says so."),
      Integer("certifier.max_observations", Between(1, 100'000'000), Problem{}.max_observations,
              "Observations kept at most: beyond it those go that never attain the envelope."),
      Optional(Map("gate", "What the certifier accepts from the bus."), "all defaults"),
      Number("gate.max_age_ms", "ms", UpTo(kHourMs), gate.max_age_ms,
             "A candidate older than this is rejected as stale."),
      Number("gate.max_ahead_ms", "ms", Between(0, kHourMs), gate.max_ahead_ms,
             "A candidate stamped further ahead of the certifier's clock is rejected as from the future."),
      Number("gate.certificate_lifetime_ms", "ms", UpTo(kHourMs), gate.certificate_lifetime_ms,
             "Execution has to begin within this time of the certificate."),
      Number("gate.decision_budget_ms", "ms", Between(0, kHourMs), gate.decision_budget_ms,
             "The most a decision may take, its way to the robot included: a candidate that starts sooner is abstained "
             "from unread."),
      Integer("gate.queue", Between(1, 65536), gate.queue,
              "Candidates that wait at most; beyond it the oldest is rejected."),
      Optional(
          Word("gate.mode", {"enforce", "shadow"},
               "shadow: decide and count as ever, but certify nothing: what would be certified is rejected as shadow."),
          "enforce"),
      Optional(
          Word("gate.arming", {"robot_state", "none"},
               "robot_state: certify only once the robot's state is heard, and latch a fault when it is lost. none: "
               "for a certifier without a robot."),
          "robot_state"),
      Number("gate.robot_timeout_ms", "ms", UpTo(kHourMs), gate.robot_timeout_ms,
             "The robot's state counts as lost after this time without one."),
      Number("gate.max_clock_jump_ms", "ms", UpTo(kHourMs), gate.max_clock_jump_ms,
             "A wall clock that moves by more than this against the time that has passed latches a fault."),
      Optional(
          Word("gate.obstacles", {"bus", "task"},
               "bus: the obstacles are task.obstacles and, besides, those that OBSTACLES says; nothing is certified "
               "before it is heard, nor while it is silent. task: task.obstacles are all, OBSTACLES is refused. "
               "forereach-certifier and `forereach run` do not start without this key."),
          "not said"),
      Number(
          "gate.obstacles_timeout_ms", "ms", UpTo(kHourMs), gate.obstacles_timeout_ms,
          "With `obstacles: bus`: the obstacles heard are no longer known this long after their stamp. Send the whole "
          "set at least every third of it."),
      Optional(Word("gate.learn", {"executed", "none"},
                    "executed: transitions that the robot reports add to the observations while it drives; "
                    "declaration.noise_bound has to cover their errors. none: the file's transitions are all."),
               "executed"),
      Optional(Word("gate.require_stop", {"true", "false"},
                    "true: only plans that provably end standing, by task.rest, are certified. false: a plan may end "
                    "moving."),
               "true with task.rest, else false"),
      Optional(
          Text("gate.state",
               "The directory, relative to this file, in which a latched fault and what contradicts a declaration "
               "outlive the certifier; `--state` takes precedence. Each robot needs one of its own, on a disk that "
               "outlives a restart of the machine."),
          "`" + gate.state + "` in the working directory"),
      Optional(Map("realtime", "What the certifier asks of the operating system."), "all defaults"),
      Optional(Word("realtime.lock_memory", {"no", "try", "require"},
                    "Keep its memory from being swapped out. try: go on where it is not allowed, and say so."),
               "try"),
      Integer(
          "realtime.fifo_priority", Between(0, 99), RealtimeOptions{}.fifo_priority,
          "Priority under SCHED_FIFO; 0 leaves the scheduler as it is. Where it is not allowed the certifier does not "
          "start."),
  };
}

std::vector<Key> BusKeys() {
  const BusOptions bus;
  return {
      Optional(Map("bus", "Where messages go."), "all defaults"),
      Optional(Text("bus.url",
                    "Where the bus is, as LCM writes it: multicast group and port, options `ttl` and `recv_buf_size`. "
                    "`--lcm-url` takes precedence."),
               bus.url),
      Optional(Text("bus.name",
                    "Name of the bus, which is part of every signature: what is signed for one bus is refused on "
                    "another. All processes of a robot need the same."),
               "address and port of the URL"),
      Optional(
          Text("bus.key",
               "Directory of keys, or one role's key file, relative to this file: every message is then "
               "signed by the role that speaks on its channel, and refused otherwise. `forereach keygen` makes it; "
               "`--key` takes precedence."),
          "none, nothing is signed"),
      Optional(Map("bus.channels", "Names of the channels, all different."), "all defaults"),
      Channel("candidate", bus.candidate, "candidate_plan_t, from planners."),
      Channel("decision", bus.decision, "decision_t, one for each candidate."),
      Channel("certified", bus.certified, "certified_plan_t, what a robot may execute."),
      Channel("robot_state", bus.robot_state, "robot_state_t, from the robot."),
      Channel("obstacles", bus.obstacles, "obstacles_t, all obstacles that are seen, again and again."),
      Channel("transition", bus.transition, "transition_t, executed steps."),
      Channel("status", bus.status, "certifier_status_v3_t, the certifier's heartbeat."),
      Channel("event", bus.event, "execution_event_t, what the robot's guard does."),
      Channel("logger_status", bus.logger_status, "logger_status_t, the logger's heartbeat."),
      Channel("fault", bus.fault, "fault_t, why the certifier has stopped certifying."),
      Channel("command", bus.command, "command_t, from a person: reset, reload."),
  };
}

std::vector<Key> PlannerKeys() {
  const PlannerOptions planner;
  return {
      Optional(Map("planner", "How candidates are made."), "all defaults"),
      Optional(
          Word("planner.source", {"ompl", "policy"},
               "ompl: searched for, clear of the obstacles. policy: blocks of a learned policy of the bicycle, which "
               "knows of no obstacles; algorithm, clearances and seed do not concern it, progress_steps may not be "
               "more than a block has, and it drives at most 10 m/s."),
          planner.source),
      Text("planner.policy", "The policy's file, relative to this one; required for `source: policy`."),
      Optional(Word("planner.algorithm", {"kpiece", "est", "pdst", "rrt", "sst"}, "The OMPL control planner."),
               planner.algorithm),
      Optional(
          Vector("planner.goal", "m", kReal, Size::kSafety, "Where the robot is to go, in the safety coordinates."),
          "no goal"),
      Number("planner.goal_radius", "m", kPositive, planner.goal_radius, "Within this distance the goal is reached."),
      Number("planner.clearance", "m", kNotNegative, planner.clearance, "Obstacles are grown by this for planning."),
      Number("planner.clearance_step", "m", kNotNegative, planner.clearance_step,
             "Added to it after each abstention S of one planning round."),
      Integer("planner.progress_steps", Between(1, kMaxSteps), planner.progress_steps,
              "Controls before the braking tail."),
      Integer("planner.tail_steps", Between(0, kMaxSteps), planner.tail_steps,
              "Longest braking tail; with progress_steps at most " + std::to_string(kMaxSteps) + "."),
      Integer("planner.lead_steps", Between(1, kMaxSteps), planner.lead_steps,
              "A candidate starts this many steps after the state it was planned from."),
      Integer("planner.candidates", Between(1, 10000), planner.candidates, "Candidates for one start at most."),
      Number("planner.cruise_speed", "m/s", kPositive, planner.cruise_speed, "Speed it aims at."),
      Number("planner.braking", "m/s^2", kPositive, planner.braking, "Deceleration of the braking tail."),
      Number("planner.time_limit_ms", "ms", UpTo(kHourMs), planner.time_limit_ms, "For one query of the planner."),
      Integer("planner.seed", Between(1, 2147483647), planner.seed, "Of the planner's random numbers."),
      Optional(Vector("planner.initial_half_width", "of the state", kNotNegative, Size::kStates,
                      "Half the width of each candidate's X0."),
               "as task.initial_set"),
  };
}

std::vector<Key> RobotKeys() {
  const RobotOptions robot;
  std::vector<Key> keys{
      Optional(Map("robot", "The simulated robot."), "all defaults"),
      Optional(Vector("robot.start", "of the state", kReal, Size::kStates, "Its state when a run begins."),
               "the center of task.initial_set"),
      Number("robot.step_period_ms", "ms", Between(0.1, 60000), robot.step_period_ms,
             "Wall-clock time of one step of the model. The certifier expects that no step of a plan takes longer than "
             "this "
             "or model.dt."),
      Number("robot.time_limit_s", "s", UpTo(1e6), robot.time_limit_s, "The run ends then, goal or not."),
      Optional(Word("robot.residual", {"none"}, "none: the robot is the nominal model."), "none"),
      Optional(Map("robot.residual", "How the real robot differs from the nominal model."), "none"),
      Required(Word("robot.residual.name", {"none", "heading_saturation", "velocity_knee"},
                    "heading_saturation is for kinematic_bicycle, velocity_knee for point_mass.")),
  };
  std::ranges::move(ParameterKeys("robot.residual"), std::back_inserter(keys));
  return keys;
}

// What is assumed of the residual, each parameter a number or an interval.
std::vector<Key> ResidualKeys() {
  std::vector<Key> keys{
      Map("residual",
          "Equations of the residual with parameters known within intervals: `forereach declare` makes the "
          "declaration from them. The certifier does not read it."),
      Required(Word("residual.name", {"heading_saturation", "velocity_knee"},
                    "heading_saturation is for kinematic_bicycle, velocity_knee for point_mass.")),
  };
  for (const Key& number : ParameterKeys("residual")) {
    keys.push_back(number);
    Key range = Vector(number.path, number.unit, number.range, Size::kAny, "Its least and its largest value.");
    range.count = Between(2, 2);
    range.only = number.only;
    keys.push_back(std::move(range));
  }
  return keys;
}

std::vector<Key> LoggerKeys() {
  const LoggerOptions logger;
  return {
      Optional(Map("logger", "What is recorded."), "all defaults"),
      Optional(Text("logger.directory", "Where the event log and the database go, relative to this file."),
               "`" + logger.directory + "` in the working directory"),
      Integer("logger.queue", Between(1, 1000000), logger.queue,
              "Messages held for writing at most; what is beyond is counted as a gap."),
      Number("logger.flush_ms", "ms", UpTo(60000), logger.flush_ms, "A killed logger loses at most this much."),
      Number("logger.rotate_mb", "MB", UpTo(kMaxMegabytes), logger.rotate_mb,
             "A log file that would grow beyond this is ended and a new one begun."),
      Number("logger.rotate_minutes", "min", UpTo(1e6), logger.rotate_minutes,
             "So is one that has been written to for this long."),
      Optional(
          Number("logger.quota_mb", "MB", UpTo(kMaxMegabytes),
                 "All log files of the directory together, at least rotate_mb: beyond it the oldest ended ones are "
                 "deleted, and where that does not help recording pauses."),
          "none is deleted"),
      Number("logger.min_free_mb", "MB", UpTo(kMaxMegabytes), logger.min_free_mb,
             "With less free on the disk recording pauses; it resumes by itself once an eighth more is free."),
      Number("logger.unsigned_kb_per_s", "kB/s", UpTo(1e6), logger.unsigned_kb_per_s,
             "With keys: of messages that nobody signed (refused ones, as evidence, and those on channels that are not "
             "ForeReach's) so much at most is recorded; the rest is counted. Each counts as 1 kB more than it has."),
  };
}

std::vector<Key> MakeSchema() {
  std::vector<Key> keys{Map("", "The task file.")};
  for (const auto part : {ModelKeys, DomainKeys, DeclarationKeys, ResidualKeys, TaskKeys, CertifierKeys, BusKeys,
                          PlannerKeys, RobotKeys, LoggerKeys})
    std::ranges::move(part(), std::back_inserter(keys));
  return keys;
}

}  // namespace

std::span<const Key> Schema() {
  static const std::vector<Key> keys = MakeSchema();
  return keys;
}

}  // namespace forereach
