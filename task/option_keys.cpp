// The rows of a task file that fill options: gate, realtime, bus, planner, robot, logger.
#include <array>
#include <iterator>
#include <set>

#include <fmt/format.h>

#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "task/key_rows.h"
#include "task/option_rows.h"
#include "task/schema_parts.h"
#include "task/step_time.h"

namespace forereach::key_rows {
namespace {

using Size = Key::Size;

constexpr double kHourMs = 3.6e6;
constexpr double kMaxMegabytes = 1e9;

// task.rest was read before.
void ReadRequireStop(const Field& at, TaskDraft& draft) {
  std::vector<RestBound>& rest = draft.problem.rest;
  const bool required = at.Text() == "true";
  if (required && rest.empty()) at.Fail("true, but task.rest does not say what standing is");
  if (!required) rest.clear();
}

// A signed sender that restarts is known with its first message after one timeout alone, and it sends at least three in
// that time. The rest is for a late one.
void CheckGate(const Field& at, TaskDraft& draft) {
  constexpr double kTimeouts = 1.5;
  const GateOptions& gate = draft.config.gate;
  if (gate.obstacles_lost_ms && *gate.obstacles_lost_ms < kTimeouts * gate.obstacles_timeout_ms)
    at.Fail("obstacles_lost_ms",
            fmt::format("{} is less than {} times gate.obstacles_timeout_ms, {}", ToText(*gate.obstacles_lost_ms),
                        ToText(kTimeouts), ToText(gate.obstacles_timeout_ms)));
}

std::vector<Key> GateKeys() {
  const OptionRows<GateOptions> gate("gate", [](TaskDraft& draft) -> GateOptions& { return draft.config.gate; });
  using Source = ObstaclesSource;
  return {
      Optional(Map("gate", "What the certifier accepts from the bus.", CheckGate), "{}"),
      gate.Number("max_age_ms", "ms", UpTo(kHourMs), &GateOptions::max_age_ms,
                  "An older candidate is rejected as stale."),
      gate.Number("max_ahead_ms", "ms", Between(0, kHourMs), &GateOptions::max_ahead_ms,
                  "A candidate stamped further ahead of the certifier's clock is rejected."),
      gate.Number("certificate_lifetime_ms", "ms", UpTo(kHourMs), &GateOptions::certificate_lifetime_ms,
                  "Execution has to begin within this time of the certificate."),
      gate.Number("decision_budget_ms", "ms", Between(0, kHourMs), &GateOptions::decision_budget_ms,
                  "For a decision and its transport to the robot. A candidate that starts sooner is answered "
                  "ABSTAIN_DEADLINE without being certified."),
      gate.Integer("max_pieces", Between(1, 64), &GateOptions::max_pieces,
                   "Above 1, an abstention S is tried again with X0 in pieces, at most so many, while less than half "
                   "of decision_budget_ms is spent: a tube from a piece is narrower."),
      gate.Integer("queue", Between(1, 65536), &GateOptions::queue,
                   "Waiting candidates at most. Above it the oldest is rejected."),
      gate.Word<bool>("mode", {{"enforce", false}, {"shadow", true}}, &GateOptions::shadow,
                      "shadow: decide and count, but certify nothing: plans are rejected with cause shadow."),
      gate.Word<bool>("advice", {{"none", false}, {"send", true}}, &GateOptions::advises,
                      "send: after an abstention S or D the certifier, if it has nothing else to do, says on "
                      "bus.channels.advice what would have helped, and the planner plans by it."),
      gate.Word<bool>("arming", {{"robot_state", true}, {"none", false}}, &GateOptions::needs_robot_state,
                      "robot_state: certify only while the robot's state is received, and latch a fault when it is "
                      "lost. none: for a certifier without a robot."),
      gate.Number("robot_timeout_ms", "ms", UpTo(kHourMs), &GateOptions::robot_timeout_ms,
                  "After this time without one the robot's state is lost."),
      gate.Number("max_clock_jump_ms", "ms", UpTo(kHourMs), &GateOptions::max_clock_jump_ms,
                  "If the wall clock moves by more against the monotonic clock, a fault is latched."),
      Optional(gate.Number("max_clock_error_ms", "ms", Between(0, kHourMs), &GateOptions::max_clock_error_ms,
                           "How far the clocks of the robot and of the obstacles' sender may differ. Moving obstacles "
                           "need this key. A robot's state or obstacles that arrive further from their stamp, less "
                           "`bus.delay_ms`, keep the certifier from certifying until one arrives inside."),
               "no obstacle may move"),
      gate.Word<Source>("obstacles", {{"bus", Source::kBus}, {"task", Source::kTask}}, &GateOptions::obstacles,
                        "bus: task.obstacles and those of the last OBSTACLES message; nothing is certified before the "
                        "first one or while they are unknown. task: task.obstacles alone; OBSTACLES is refused. "
                        "forereach-certifier and `forereach run` require this key."),
      gate.Number("obstacles_timeout_ms", "ms", UpTo(kHourMs), &GateOptions::obstacles_timeout_ms,
                  "With `obstacles: bus`: they become unknown this long after the stamp of the last message. Send the "
                  "whole set at least three times in this period."),
      gate.Number("obstacles_lost_ms", "ms", UpTo(kHourMs), &GateOptions::obstacles_lost_ms,
                  "Required with `obstacles: bus`, at least 1.5 times obstacles_timeout_ms. When the obstacles have "
                  "been unknown for so long, plans under way are withdrawn: an emergency stop, which no certificate "
                  "covers. For so long a robot may drive among obstacles that nobody sees."),
      Word("gate.obstacles_lost_ms", {"never"},
           "The robot executes its plan to the end, through whatever has come there.",
           [](const Field&, TaskDraft& draft) { draft.config.gate.obstacles_lost_ms = kNeverLost; }),
      gate.Word<bool>("learn", {{"executed", true}, {"none", false}}, &GateOptions::learns,
                      "executed: transitions that the robot reports become observations; declaration.state_error, "
                      "noise_bound and disturbance have to cover them. none: only the file's."),
      Optional(Word("gate.require_stop", {"true", "false"},
                    "true: certify only plans that provably end at rest, by task.rest. false: they may end in motion.",
                    ReadRequireStop),
               "true with task.rest, otherwise false"),
      gate.File(
          "state", &GateOptions::state,
          "Directory, relative to this file, for what survives a restart: a latched fault, and transitions that "
          "contradict a declaration. `--state` takes precedence. Each robot needs its own, on a disk that keeps it."),
  };
}

std::vector<Key> RealtimeKeys() {
  const OptionRows<RealtimeOptions> realtime(
      "realtime", [](TaskDraft& draft) -> RealtimeOptions& { return draft.config.realtime; });
  using Lock = RealtimeOptions::Lock;
  return {
      Optional(Map("realtime", "Real-time options of the certifier."), "{}"),
      realtime.Word<Lock>("lock_memory", {{"no", Lock::kNo}, {"try", Lock::kTry}, {"require", Lock::kRequire}},
                          &RealtimeOptions::lock_memory,
                          "Keep memory from being swapped out. try: with a warning if it is not allowed."),
      realtime.Integer(
          "fifo_priority", Between(0, 99), &RealtimeOptions::fifo_priority,
          "Priority under SCHED_FIFO; 0 keeps the scheduler. If it is not allowed, the certifier does not start."),
      realtime.Word<bool>(
          "keep_warm", {{"false", false}, {"true", true}}, &RealtimeOptions::keep_warm,
          "true: while nothing waits, the certifier repeats its last certificate up to a thousand times "
          "a second, so that the next decision does not wait for memory. Takes some per cent of a core."),
  };
}

struct ChannelRow {
  const char* name;
  std::string BusOptions::*member;
  const char* meaning;
};

constexpr std::array kChannels{
    ChannelRow{"candidate", &BusOptions::candidate, "candidate_plan_t and candidate_batch_t, from planners."},
    ChannelRow{"decision", &BusOptions::decision, "decision_t, one for each candidate."},
    ChannelRow{"certified", &BusOptions::certified, "certified_plan_t, what a robot may execute."},
    ChannelRow{"withdrawn", &BusOptions::withdrawn, "withdrawal_t, what of it a robot may no longer execute."},
    ChannelRow{"advice", &BusOptions::advice,
               "advice_t, what would have helped a candidate, with gate.advice: send or for one that asks."},
    ChannelRow{"robot_state", &BusOptions::robot_state, "robot_state_t, from the robot."},
    ChannelRow{"obstacles", &BusOptions::obstacles, "obstacles_t, all perceived obstacles, sent repeatedly."},
    ChannelRow{"transition", &BusOptions::transition, "transition_t, executed steps."},
    ChannelRow{"status", &BusOptions::status, "certifier_status_t, the certifier's heartbeat."},
    ChannelRow{"event", &BusOptions::event, "execution_event_t, events of the robot's guard."},
    ChannelRow{"logger_status", &BusOptions::logger_status, "logger_status_t, the logger's heartbeat."},
    ChannelRow{"fault", &BusOptions::fault, "fault_t, why nothing is certified."},
    ChannelRow{"command", &BusOptions::command, "command_t, from an operator: reset, reload."},
};

void RequireDifferentChannels(const Field& at, TaskDraft& draft) {
  std::set<std::string> names;
  for (const ChannelRow& channel : kChannels)
    if (const std::string& name = draft.config.bus.*channel.member; !names.insert(name).second)
      at.Fail(channel.name, fmt::format("{} is the name of another channel too", name));
}

std::vector<Key> BusKeys() {
  const OptionRows<BusOptions> bus("bus", [](TaskDraft& draft) -> BusOptions& { return draft.config.bus; });
  const OptionRows<BusOptions> channels("bus.channels",
                                        [](TaskDraft& draft) -> BusOptions& { return draft.config.bus; });
  std::vector<Key> keys{
      Optional(Map("bus", "The bus and its channels."), "{}"),
      bus.Text(
          "url", &BusOptions::url,
          "In LCM's form: multicast group and port, options `ttl` and `recv_buf_size`. `--lcm-url` takes precedence."),
      bus.Number("delay_ms", "ms", Between(0, kHourMs), &BusOptions::delay_ms,
                 "The longest time from a message's stamp to its arrival at the certifier if all clocks agree. With "
                 "gate.max_clock_error_ms, what arrives later by more than that is taken for that of a clock that is "
                 "behind. One that is behind by less may stay unnoticed, so declare no more than is needed."),
      Optional(bus.Text("name", &BusOptions::name,
                        "Part of every signature: a message for one bus is refused on another. All processes of a "
                        "robot need the same name."),
               "address and port of the URL"),
      Optional(
          bus.File(
              "key", &BusOptions::key,
              "Directory of keys, or one role's file, relative to this file. Then every message has to be signed by "
              "the role that owns its channel. `forereach keygen` makes the directory; `--key` takes precedence."),
          "nothing is signed"),
      Optional(Map("bus.channels", "Names of the channels, all different.", RequireDifferentChannels), "{}"),
  };
  for (const ChannelRow& channel : kChannels)
    keys.push_back(channels.Channel(channel.name, channel.member, channel.meaning));
  return keys;
}

void CheckPlanner(const Field& at, TaskDraft& draft) {
  CheckLaws(at.file(), draft);
  const PlannerOptions& planner = draft.config.planner;
  if (planner.source == "policy" && planner.policy.empty())
    at.Fail("policy", "missing: a policy's file, for planner.source: policy");
  if (const int steps = planner.progress_steps + planner.tail_steps; steps > kMaxSteps)
    at.Fail("tail_steps", fmt::format("{} is outside [0, {}]: with progress_steps {} steps, a plan has at most {}",
                                      planner.tail_steps, kMaxSteps - planner.progress_steps, steps, kMaxSteps));
}

std::vector<Key> PlannerKeys() {
  const OptionRows<PlannerOptions> planner("planner",
                                           [](TaskDraft& draft) -> PlannerOptions& { return draft.config.planner; });
  std::vector<Key> keys{
      Optional(Map("planner", "The planner.", CheckPlanner), "{}"),
      planner.OneOf(
          "source", {"ompl", "policy"}, &PlannerOptions::source,
          "ompl: a search around the obstacles. policy: blocks of a learned policy of the bicycle, which ignores "
          "obstacles, algorithm, clearances and seed; progress_steps is at most a block, the speed at most 10 m/s."),
      planner.File("policy", &PlannerOptions::policy, "Its file, relative to this one; required for `source: policy`."),
      planner.OneOf("algorithm", {"kpiece", "est", "pdst", "rrt", "sst"}, &PlannerOptions::algorithm,
                    "The OMPL control planner."),
      Optional(planner.Vector("goal", "m", kReal, Size::kSafety, &PlannerOptions::goal, "In the safety coordinates."),
               "no goal"),
      planner.Number("goal_radius", "m", kPositive, &PlannerOptions::goal_radius,
                     "Within this distance the goal is reached."),
      planner.Number("clearance", "m", kNotNegative, &PlannerOptions::clearance,
                     "Obstacles are grown by this for planning."),
      planner.Number("clearance_step", "m", kNotNegative, &PlannerOptions::clearance_step,
                     "Added after each abstention S of a planning round. A plan that follows the hints keeps eight "
                     "times this more."),
      planner.Integer("progress_steps", Between(1, kMaxSteps), &PlannerOptions::progress_steps,
                      "Controls before the braking tail."),
      planner.Integer("tail_steps", Between(0, kMaxSteps), &PlannerOptions::tail_steps,
                      fmt::format("Longest braking tail; with progress_steps at most {}.", kMaxSteps)),
      planner.Integer("lead_steps", Between(1, kMaxSteps), &PlannerOptions::lead_steps,
                      "A candidate starts so many steps after the state it was planned from."),
      planner.Integer("candidates", Between(1, 10000), &PlannerOptions::candidates, "The most for one start."),
      planner.Integer("policy_samples", Between(1, 10000), &PlannerOptions::policy_samples,
                      "Of `source: policy`: so many candidates are sampled at once and sent in batches; `candidates` "
                      "is then the most batches."),
      planner.Word<bool>("certifies", {{"false", false}, {"true", true}}, &PlannerOptions::certifies,
                         "true: the search certifies each step that it takes, so its plans keep at least as clear "
                         "as their tubes need. Not of `source: policy`."),
      planner.Word<bool>("repair", {{"false", false}, {"true", true}}, &PlannerOptions::repairs,
                         "true: candidates ask the certifier for the nearest plan that it would certify, and a start "
                         "for which no candidate was certified gets the nearest of these."),
      planner.Number("cruise_speed", "m/s", kPositive, &PlannerOptions::cruise_speed, "The desired speed."),
      planner.Number("braking", "m/s^2", kPositive, &PlannerOptions::braking,
                     "Acceleration and deceleration that the search expects of the robot."),
      planner.Number("time_limit_ms", "ms", UpTo(kHourMs), &PlannerOptions::time_limit_ms,
                     "Of one query, counted in steps of the model, 400 a millisecond; slow models take longer."),
      planner.Integer("seed", Between(1, 2147483647), &PlannerOptions::seed, "Of the planner's random numbers."),
      Optional(
          planner.Vector("initial_half_width", "of the state", kNotNegative, Size::kStates,
                         &PlannerOptions::initial_half_width,
                         "Half the width of each candidate's X0 without the state error, by which the planner widens "
                         "it: how far the state that is measured at the start may be from the predicted one."),
          "as task.initial_set"),
  };
  std::ranges::move(LawKeys(), std::back_inserter(keys));
  return keys;
}

// A kind of numbers within bounds of the declaration.
Key WithinDeclared(const OptionRows<RobotOptions>& robot, const char* name, std::string RobotOptions::*kind,
                   bool (*is_declared)(const Declaration&), const char* bounds_name, const char* meaning) {
  Key key = robot.OneOf(name, {"none", "random", "adversarial"}, kind, meaning);
  key.read = [=, read = key.read](const Field& at, TaskDraft& draft) {
    read(at, draft);
    if (draft.config.robot.*kind != "none" && !is_declared(draft.problem.declaration))
      at.Fail(fmt::format("{}, and declaration.{} allows for none", draft.config.robot.*kind, bounds_name));
  };
  return key;
}

Key RobotJitter(const OptionRows<RobotOptions>& robot) {
  Key key = robot.OneOf(
      "step_jitter", {"none", "random", "adversarial"}, &RobotOptions::step_jitter,
      "How far its steps are off their times, within robot.step_error_ms: a boundary is up to half of that early or "
      "late, and so are two of them by all of it. random: uniformly. adversarial: by all of the half, early or late.");
  key.read = [read = key.read](const Field& at, TaskDraft& draft) {
    read(at, draft);
    if (draft.config.robot.step_jitter != "none" && StepErrorUs(draft.config.gate).value_or(0) == 0)
      at.Fail(fmt::format("{}, and robot.step_error_ms allows for none", draft.config.robot.step_jitter));
  };
  return key;
}

// robot.hold was read before.
void ReadEmergencyStop(const Field& at, TaskDraft& draft) {
  RobotOptions& robot = draft.config.robot;
  const NominalModel& model = *draft.problem.model;
  const NamedModel* const named = FindNamed(model);
  const auto is_at_rest = [&](const std::string& name) {
    return std::ranges::any_of(draft.rest,
                               [&](const RestBound& b) { return model.state_names()[ToSize(b.coordinate)] == name; });
  };
  for (const Field& rate : at.Entries()) {
    const std::string& name = rate.name();
    const bool is_held = robot.hold         ? std::ranges::find(*robot.hold, name) != robot.hold->end()
                         : named == nullptr ? is_at_rest(name)
                                            : std::ranges::find(named->standing, name) != named->standing.end();
    if (!is_held) rate.Fail("is not zero while the robot stands: robot.hold does not name it");
    robot.emergency_stop[name] = rate.Number();
  }
  if (robot.emergency_stop.empty()) at.Fail("names no state, so nothing would be braked");
}

// "; v and a of ...": what stands still in each model of the library, to go on with a sentence.
std::string StandingOfNamedModels() {
  std::string text;
  for (const NamedModel& model : NamedModels()) {
    std::string states;
    for (const std::string_view state : model.standing) states += (states.empty() ? "" : " and ") + std::string(state);
    text += fmt::format("{}{} of {}", text.empty() ? "; " : ", ", states, model.name);
  }
  return text;
}

std::vector<Key> RobotKeys() {
  const OptionRows<RobotOptions> robot("robot", [](TaskDraft& draft) -> RobotOptions& { return draft.config.robot; });
  return {
      Optional(Map("robot", "The simulated robot."), "{}"),
      Optional(robot.Vector("start", "of the state", kReal, Size::kStates, &RobotOptions::start, "Its initial state."),
               "the center of task.initial_set"),
      Optional(
          Names(
              "robot.hold", Between(0, kMaxStates), Size::kStates,
              "The states that become zero while the robot stands and holds its position. `[]`, for one that cannot "
              "stand: it keeps its state. Planner and simulated robot require this, or task.rest with a model as text.",
              [](const Field& at, TaskDraft& draft) { draft.config.robot.hold = at.Names(); }),
          fmt::format("those of task.rest with a model as text{}", StandingOfNamedModels())),
      Optional(
          Map("robot.emergency_stop",
              "How the robot comes to rest by itself. The guard computes from it how many steps a stop takes, and "
              "begins one early enough to end within what a withdrawal leaves. The simulated robot follows its "
              "equations meanwhile, with inputs of zero. States of robot.hold that are not named are zero at once.",
              ReadEmergencyStop),
          "all states of robot.hold are zero at once, at any speed, as no real robot can"),
      Number("robot.emergency_stop.<state>", "of the state, per second of the model", kPositive,
             "Its absolute value falls at least so fast. One of robot.hold."),
      Optional(Number("robot.step_error_ms", "ms", Between(0, kHourMs),
                      "Required where the robot's state arms the certifier. How far the boundary of a step may be from "
                      "its time on the robot's clock, counted from the plan's start and from its first step; below "
                      "half of model.dt. The robot's guard stops a plan at a step that is further off or lasts longer "
                      "by more, and certificates hold for all steps within. 0: steps are on time.",
                      [](const Field& at, TaskDraft& draft) { draft.config.gate.step_error_ms = at.Number(); }),
               "certificates say that steps are on time"),
      Word("robot.step_error_ms", {"any"},
           "Steps are taken at any time, and nobody looks at a clock: certificates hold for steps on time, and those "
           "of another duration are learned where the model's equations or rates explain it. Not with "
           "gate.max_clock_error_ms.",
           [](const Field&, TaskDraft& draft) { draft.config.gate.step_error_ms = kAnyTime; }),
      Optional(
          robot.Number(
              "step_period_ms", "ms", Between(0.1, 60000), &RobotOptions::step_period_ms,
              "Wall-clock time of a step. The certifier takes steps to last no longer than this or model.dt. With "
              "bounds in task.between, or a clock (robot.step_error_ms, gate.max_clock_error_ms), it is model.dt."),
          "model.dt"),
      robot.Number("time_limit_s", "s", UpTo(1e6), &RobotOptions::time_limit_s,
                   "The run ends after it, even without the goal."),
      WithinDeclared(
          robot, "disturbance", &RobotOptions::disturbance,
          [](const Declaration& declaration) { return declaration.IsDisturbed(); }, "disturbance",
          "In each step, within declaration.disturbance. random: of each state a uniform value. adversarial: of each "
          "state its bound, with signs that stay for 1 to 32 steps."),
      WithinDeclared(
          robot, "sensor_error", &RobotOptions::sensor_error,
          [](const Declaration& declaration) { return !declaration.state_error.isZero(0); }, "state_error",
          "By how much measured states are off the true ones, within declaration.state_error: likewise."),
      WithinDeclared(
          robot, "input_error", &RobotOptions::input_error,
          [](const Declaration& declaration) { return !declaration.input_error.isZero(0); }, "input_error",
          "By how much the inputs that act are off the plan's, within declaration.input_error: likewise."),
      RobotJitter(robot),
      robot.Integer("disturbance_seed", Between(0, 2147483647), &RobotOptions::disturbance_seed,
                    "Of the random numbers of disturbance, sensor_error, input_error and step_jitter."),
  };
}

void CheckLogger(const Field& at, TaskDraft& draft) {
  const LoggerOptions& logger = draft.config.logger;
  if (logger.quota_mb && *logger.quota_mb < logger.rotate_mb)
    at.Fail("quota_mb",
            fmt::format("{} is less than logger.rotate_mb, {}", ToText(*logger.quota_mb), ToText(logger.rotate_mb)));
}

std::vector<Key> LoggerKeys() {
  const OptionRows<LoggerOptions> logger("logger",
                                         [](TaskDraft& draft) -> LoggerOptions& { return draft.config.logger; });
  return {
      Optional(Map("logger", "The logger.", CheckLogger), "{}"),
      logger.File("directory", &LoggerOptions::directory, "For event logs and database, relative to this file."),
      logger.Integer("queue", Between(1, 1000000), &LoggerOptions::queue,
                     "The most messages that wait for writing. Those above are counted as a gap."),
      logger.Number("flush_ms", "ms", UpTo(60000), &LoggerOptions::flush_ms,
                    "A killed logger loses at most the messages of this period."),
      logger.Number("rotate_mb", "MB", UpTo(kMaxMegabytes), &LoggerOptions::rotate_mb,
                    "A log file ends, and a new one begins, before it exceeds this."),
      logger.Number("rotate_minutes", "min", UpTo(1e6), &LoggerOptions::rotate_minutes,
                    "A log file ends, too, after this time."),
      Optional(logger.Number("quota_mb", "MB", UpTo(kMaxMegabytes), &LoggerOptions::quota_mb,
                             "All log files of the directory together, at least rotate_mb. Above it the oldest ended "
                             "files are deleted; if that is not enough, recording pauses."),
               "no quota"),
      logger.Number("min_free_mb", "MB", UpTo(kMaxMegabytes), &LoggerOptions::min_free_mb,
                    "With less free on the disk recording pauses, until an eighth more is free."),
      logger.Number("unsigned_kb_per_s", "kB/s", UpTo(1e6), &LoggerOptions::unsigned_kb_per_s,
                    "With keys: the largest rate at which refused messages, and those on channels that are not "
                    "ForeReach's, are recorded; each counts as its size plus 1 kB. The others are counted."),
  };
}

}  // namespace

std::vector<Key> OptionKeys() {
  std::vector<Key> keys;
  for (const auto part : {GateKeys, RealtimeKeys, BusKeys, PlannerKeys, RobotKeys, RobotResidualKeys, LoggerKeys})
    std::ranges::move(part(), std::back_inserter(keys));
  return keys;
}

}  // namespace forereach::key_rows
