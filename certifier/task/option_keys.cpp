// The rows of a task file that fill options: gate, realtime, bus, planner, robot, logger.
#include <array>
#include <iterator>
#include <set>

#include "certifier/numerics/limits.h"
#include "certifier/task/key_rows.h"

namespace forereach::key_rows {
namespace {

using Size = Key::Size;

constexpr double kHourMs = 3.6e6;
constexpr double kMaxMegabytes = 1e9;

// task.rest was read before.
void ReadRequireStop(const Document& file, const std::string& key, TaskDraft& draft) {
  std::vector<RestBound>& rest = draft.problem.rest;
  const bool required = file.Text(key) == "true";
  if (required && rest.empty()) file.Fail(key, "true, but task.rest does not say what standing is");
  if (!required) rest.clear();
}

std::vector<Key> GateKeys() {
  const OptionRows<GateOptions> gate("gate", [](TaskDraft& draft) -> GateOptions& { return draft.config.gate; });
  using Source = ObstaclesSource;
  return {
      Optional(Map("gate", "What the certifier accepts from the bus."), "all defaults"),
      gate.Number("max_age_ms", "ms", UpTo(kHourMs), &GateOptions::max_age_ms,
                  "A candidate older than this is rejected as stale."),
      gate.Number("max_ahead_ms", "ms", Between(0, kHourMs), &GateOptions::max_ahead_ms,
                  "A candidate stamped further ahead of the certifier's clock is rejected as from the future."),
      gate.Number("certificate_lifetime_ms", "ms", UpTo(kHourMs), &GateOptions::certificate_lifetime_ms,
                  "Execution has to begin within this time of the certificate."),
      gate.Number("decision_budget_ms", "ms", Between(0, kHourMs), &GateOptions::decision_budget_ms,
                  "The most a decision may take, its way to the robot included: a candidate that starts sooner is "
                  "abstained from unread."),
      gate.Integer("queue", Between(1, 65536), &GateOptions::queue,
                   "Candidates that wait at most; beyond it the oldest is rejected."),
      gate.Word<bool>("mode", {{"enforce", false}, {"shadow", true}}, &GateOptions::shadow,
                      "shadow: decide and count as ever, but certify nothing: what would be certified is rejected as "
                      "shadow."),
      gate.Word<bool>("arming", {{"robot_state", true}, {"none", false}}, &GateOptions::needs_robot_state,
                      "robot_state: certify only once the robot's state is heard, and latch a fault when it is lost. "
                      "none: for a certifier without a robot."),
      gate.Number("robot_timeout_ms", "ms", UpTo(kHourMs), &GateOptions::robot_timeout_ms,
                  "The robot's state counts as lost after this time without one."),
      gate.Number("max_clock_jump_ms", "ms", UpTo(kHourMs), &GateOptions::max_clock_jump_ms,
                  "A wall clock that moves by more than this against the time that has passed latches a fault."),
      Optional(
          gate.Word<Source>(
              "obstacles", {{"bus", Source::kBus}, {"task", Source::kTask}}, &GateOptions::obstacles,
              "bus: the obstacles are task.obstacles and, besides, those that OBSTACLES says; nothing is certified "
              "before it is heard, nor while it is silent. task: task.obstacles are all, OBSTACLES is refused. "
              "forereach-certifier and `forereach run` do not start without this key."),
          "not said"),
      gate.Number(
          "obstacles_timeout_ms", "ms", UpTo(kHourMs), &GateOptions::obstacles_timeout_ms,
          "With `obstacles: bus`: the obstacles heard are no longer known this long after their stamp. Send the "
          "whole set at least every third of it."),
      gate.Word<bool>("learn", {{"executed", true}, {"none", false}}, &GateOptions::learns,
                      "executed: transitions that the robot reports add to the observations while it drives; "
                      "declaration.noise_bound has to cover their errors. none: the file's transitions are all."),
      Optional(Word("gate.require_stop", {"true", "false"},
                    "true: only plans that provably end standing, by task.rest, are certified. false: a plan may end "
                    "moving.",
                    ReadRequireStop),
               "true with task.rest, else false"),
      gate.File("state", &GateOptions::state,
                "The directory, relative to this file, in which a latched fault and what contradicts a declaration "
                "outlive the certifier; `--state` takes precedence. Each robot needs one of its own, on a disk that "
                "outlives a restart of the machine."),
  };
}

std::vector<Key> RealtimeKeys() {
  const OptionRows<RealtimeOptions> realtime(
      "realtime", [](TaskDraft& draft) -> RealtimeOptions& { return draft.config.realtime; });
  using Lock = RealtimeOptions::Lock;
  return {
      Optional(Map("realtime", "What the certifier asks of the operating system."), "all defaults"),
      realtime.Word<Lock>("lock_memory", {{"no", Lock::kNo}, {"try", Lock::kTry}, {"require", Lock::kRequire}},
                          &RealtimeOptions::lock_memory,
                          "Keep its memory from being swapped out. try: go on where it is not allowed, and say so."),
      realtime.Integer("fifo_priority", Between(0, 99), &RealtimeOptions::fifo_priority,
                       "Priority under SCHED_FIFO; 0 leaves the scheduler as it is. Where it is not allowed the "
                       "certifier does not start."),
  };
}

struct ChannelRow {
  const char* name;
  std::string BusOptions::*member;
  const char* meaning;
};

constexpr std::array kChannels{
    ChannelRow{"candidate", &BusOptions::candidate, "candidate_plan_t, from planners."},
    ChannelRow{"decision", &BusOptions::decision, "decision_t, one for each candidate."},
    ChannelRow{"certified", &BusOptions::certified, "certified_plan_t, what a robot may execute."},
    ChannelRow{"robot_state", &BusOptions::robot_state, "robot_state_t, from the robot."},
    ChannelRow{"obstacles", &BusOptions::obstacles, "obstacles_t, all obstacles that are seen, again and again."},
    ChannelRow{"transition", &BusOptions::transition, "transition_t, executed steps."},
    ChannelRow{"status", &BusOptions::status, "certifier_status_v3_t, the certifier's heartbeat."},
    ChannelRow{"event", &BusOptions::event, "execution_event_t, what the robot's guard does."},
    ChannelRow{"logger_status", &BusOptions::logger_status, "logger_status_t, the logger's heartbeat."},
    ChannelRow{"fault", &BusOptions::fault, "fault_t, why the certifier has stopped certifying."},
    ChannelRow{"command", &BusOptions::command, "command_t, from a person: reset, reload."},
};

void RequireDifferentChannels(const Document& file, const std::string& key, TaskDraft& draft) {
  std::set<std::string> names;
  for (const ChannelRow& channel : kChannels)
    if (const std::string& name = draft.config.bus.*channel.member; !names.insert(name).second)
      file.Fail(key + "." + channel.name, name + " is the name of another channel too");
}

std::vector<Key> BusKeys() {
  const OptionRows<BusOptions> bus("bus", [](TaskDraft& draft) -> BusOptions& { return draft.config.bus; });
  const OptionRows<BusOptions> channels("bus.channels",
                                        [](TaskDraft& draft) -> BusOptions& { return draft.config.bus; });
  std::vector<Key> keys{
      Optional(Map("bus", "Where messages go."), "all defaults"),
      bus.Text("url", &BusOptions::url,
               "Where the bus is, as LCM writes it: multicast group and port, options `ttl` and `recv_buf_size`. "
               "`--lcm-url` takes precedence."),
      Optional(bus.Text("name", &BusOptions::name,
                        "Name of the bus, which is part of every signature: what is signed for one bus is refused on "
                        "another. All processes of a robot need the same."),
               "address and port of the URL"),
      Optional(
          bus.File("key", &BusOptions::key,
                   "Directory of keys, or one role's key file, relative to this file: every message is then "
                   "signed by the role that speaks on its channel, and refused otherwise. `forereach keygen` makes "
                   "it; `--key` takes precedence."),
          "none, nothing is signed"),
      Optional(Map("bus.channels", "Names of the channels, all different.", RequireDifferentChannels), "all defaults"),
  };
  for (const ChannelRow& channel : kChannels)
    keys.push_back(channels.Channel(channel.name, channel.member, channel.meaning));
  return keys;
}

void CheckPlanner(const Document& file, const std::string&, TaskDraft& draft) {
  const PlannerOptions& planner = draft.config.planner;
  if (planner.source == "policy" && planner.policy.empty())
    file.Fail("planner.policy", "missing: a policy's file, for planner.source: policy");
  if (const int steps = planner.progress_steps + planner.tail_steps; steps > kMaxSteps)
    file.Fail("planner.tail_steps", std::to_string(planner.tail_steps) + " is outside [0, " +
                                        std::to_string(kMaxSteps - planner.progress_steps) + "]: with progress_steps " +
                                        std::to_string(steps) + " steps, a plan has at most " +
                                        std::to_string(kMaxSteps));
}

std::vector<Key> PlannerKeys() {
  const OptionRows<PlannerOptions> planner("planner",
                                           [](TaskDraft& draft) -> PlannerOptions& { return draft.config.planner; });
  return {
      Optional(Map("planner", "How candidates are made.", CheckPlanner), "all defaults"),
      planner.OneOf("source", {"ompl", "policy"}, &PlannerOptions::source,
                    "ompl: searched for, clear of the obstacles. policy: blocks of a learned policy of the bicycle, "
                    "which knows of no obstacles; algorithm, clearances and seed do not concern it, progress_steps may "
                    "not be more than a block has, and it drives at most 10 m/s."),
      planner.File("policy", &PlannerOptions::policy,
                   "The policy's file, relative to this one; required for `source: policy`."),
      planner.OneOf("algorithm", {"kpiece", "est", "pdst", "rrt", "sst"}, &PlannerOptions::algorithm,
                    "The OMPL control planner."),
      Optional(planner.Vector("goal", "m", kReal, Size::kSafety, &PlannerOptions::goal,
                              "Where the robot is to go, in the safety coordinates."),
               "no goal"),
      planner.Number("goal_radius", "m", kPositive, &PlannerOptions::goal_radius,
                     "Within this distance the goal is reached."),
      planner.Number("clearance", "m", kNotNegative, &PlannerOptions::clearance,
                     "Obstacles are grown by this for planning."),
      planner.Number("clearance_step", "m", kNotNegative, &PlannerOptions::clearance_step,
                     "Added to it after each abstention S of one planning round."),
      planner.Integer("progress_steps", Between(1, kMaxSteps), &PlannerOptions::progress_steps,
                      "Controls before the braking tail."),
      planner.Integer("tail_steps", Between(0, kMaxSteps), &PlannerOptions::tail_steps,
                      "Longest braking tail; with progress_steps at most " + std::to_string(kMaxSteps) + "."),
      planner.Integer("lead_steps", Between(1, kMaxSteps), &PlannerOptions::lead_steps,
                      "A candidate starts this many steps after the state it was planned from."),
      planner.Integer("candidates", Between(1, 10000), &PlannerOptions::candidates,
                      "Candidates for one start at most."),
      planner.Number("cruise_speed", "m/s", kPositive, &PlannerOptions::cruise_speed, "Speed it aims at."),
      planner.Number("braking", "m/s^2", kPositive, &PlannerOptions::braking, "Deceleration of the braking tail."),
      planner.Number("time_limit_ms", "ms", UpTo(kHourMs), &PlannerOptions::time_limit_ms,
                     "For one query of the planner."),
      planner.Integer("seed", Between(1, 2147483647), &PlannerOptions::seed, "Of the planner's random numbers."),
      Optional(planner.Vector("initial_half_width", "of the state", kNotNegative, Size::kStates,
                              &PlannerOptions::initial_half_width, "Half the width of each candidate's X0."),
               "as task.initial_set"),
  };
}

std::vector<Key> RobotKeys() {
  const OptionRows<RobotOptions> robot("robot", [](TaskDraft& draft) -> RobotOptions& { return draft.config.robot; });
  return {
      Optional(Map("robot", "The simulated robot."), "all defaults"),
      Optional(robot.Vector("start", "of the state", kReal, Size::kStates, &RobotOptions::start,
                            "Its state when a run begins."),
               "the center of task.initial_set"),
      robot.Number(
          "step_period_ms", "ms", Between(0.1, 60000), &RobotOptions::step_period_ms,
          "Wall-clock time of one step of the model. The certifier expects that no step of a plan takes longer "
          "than this or model.dt."),
      robot.Number("time_limit_s", "s", UpTo(1e6), &RobotOptions::time_limit_s, "The run ends then, goal or not."),
      robot.OneOf("residual", {"none"}, &RobotOptions::residual, "none: the robot is the nominal model."),
  };
}

void CheckLogger(const Document& file, const std::string&, TaskDraft& draft) {
  const LoggerOptions& logger = draft.config.logger;
  if (logger.quota_mb && *logger.quota_mb < logger.rotate_mb)
    file.Fail("logger.quota_mb",
              ToText(*logger.quota_mb) + " is less than logger.rotate_mb, " + ToText(logger.rotate_mb));
}

std::vector<Key> LoggerKeys() {
  const OptionRows<LoggerOptions> logger("logger",
                                         [](TaskDraft& draft) -> LoggerOptions& { return draft.config.logger; });
  return {
      Optional(Map("logger", "What is recorded.", CheckLogger), "all defaults"),
      logger.File("directory", &LoggerOptions::directory,
                  "Where the event log and the database go, relative to this file."),
      logger.Integer("queue", Between(1, 1000000), &LoggerOptions::queue,
                     "Messages held for writing at most; what is beyond is counted as a gap."),
      logger.Number("flush_ms", "ms", UpTo(60000), &LoggerOptions::flush_ms,
                    "A killed logger loses at most this much."),
      logger.Number("rotate_mb", "MB", UpTo(kMaxMegabytes), &LoggerOptions::rotate_mb,
                    "A log file that would grow beyond this is ended and a new one begun."),
      logger.Number("rotate_minutes", "min", UpTo(1e6), &LoggerOptions::rotate_minutes,
                    "So is one that has been written to for this long."),
      Optional(logger.Number("quota_mb", "MB", UpTo(kMaxMegabytes), &LoggerOptions::quota_mb,
                             "All log files of the directory together, at least rotate_mb: beyond it the oldest ended "
                             "ones are deleted, and where that does not help recording pauses."),
               "none is deleted"),
      logger.Number("min_free_mb", "MB", UpTo(kMaxMegabytes), &LoggerOptions::min_free_mb,
                    "With less free on the disk recording pauses; it resumes by itself once an eighth more is free."),
      logger.Number("unsigned_kb_per_s", "kB/s", UpTo(1e6), &LoggerOptions::unsigned_kb_per_s,
                    "With keys: of messages that nobody signed (refused ones, as evidence, and those on channels that "
                    "are not ForeReach's) so much at most is recorded; the rest is counted. Each counts as 1 kB more "
                    "than it has."),
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
