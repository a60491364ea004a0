#include "simulator/sim_node.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bus/bus_options.h"
#include "bus/log.h"
#include "certifier/gate/stamp.h"
#include "clients/supervised.h"
#include "forereach/execution_event_t.hpp"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "lcmtypes/why_failed.h"
#include "task/json_text.h"
#include "task/step_time.h"

namespace forereach {
namespace {

constexpr std::int64_t kProgressUs = 1'000'000;
constexpr std::int64_t kRefusedStarts = 10;  // so many are no accident
const std::string_view kOutsideX0 = GuardCauseName(GuardCause::kOutsideInitialSet);

// z of a state and an input.
std::vector<double> Joined(std::span<const double> x, std::span<const double> u) {
  std::vector<double> z(x.begin(), x.end());
  z.insert(z.end(), u.begin(), u.end());
  return z;
}

std::optional<Config> Load(const std::string& path, const BusOptions& in_force) try {
  Config config = LoadConfig(path);
  const std::string why = WhyKeyCannotChange(in_force, config.bus, Role::kRobot);
  if (!why.empty()) throw ConfigError("{}: {}", path, why);
  return config;
} catch (const std::exception& error) {
  logging::Error("not reloaded: {}", WhyFailed(error));
  return std::nullopt;
}

// Acts on the states that are zero while the robot stands. @throws ConfigError if nobody says which.
Brake BrakeOf(const Config& config) {
  const std::vector<std::string>& names = config.problem->model->state_names();
  std::vector<double> declines(names.size(), 0.0);
  for (const int k : HeldStates(config)) {
    const auto rate = config.robot.emergency_stop.find(names[ToSize(k)]);
    const bool is_gradual = rate != config.robot.emergency_stop.end();
    declines[ToSize(k)] = is_gradual ? rate->second * config.period : kInfinity;
  }
  return Brake(std::move(declines));
}

Plant TargetOf(const Config& config) {
  return [target = std::shared_ptr<const Target>(MakeTarget(config))](auto x, auto u, auto next, double longer) {
    target->Step(x, u, next, longer);
  };
}

Config WithKeysOfRobot(Config config) {
  config.bus = WithKeys(std::move(config.bus), Role::kRobot);
  return config;
}

void RequireSize(const Config& config, const char* key, std::size_t size, std::int64_t expected) {
  if (static_cast<std::int64_t>(size) != expected)
    throw ConfigError("{}: {}: {} entries, it has to have {}", config.path, key, size, expected);
}

}  // namespace

RobotSimNode::RobotSimNode(const Config& config, Bus& bus, std::ostream& out, Plant plant)
    : config_(WithKeysOfRobot(config)),
      bus_(bus),
      out_(out),
      plant_(plant ? std::move(plant) : TargetOf(config)),
      places_(*config.problem->model, config.problem->projection, config.problem->body),
      limits_(*config.problem->model, config.problem->limits),
      disturbance_(config.problem->declaration, config.robot),
      sensor_(Disturbance::OfMeasurements(config.problem->declaration, config.robot)),
      inputs_(Disturbance::OfInputs(config.problem->declaration, config.robot)),
      jitter_(config),
      period_us_(Microseconds(config.robot.step_period_ms)),
      most_late_us_(StepErrorUs(config.gate) ? period_us_ / 2 : 0),
      brake_(BrakeOf(config_)),
      reload_([path = config.path, bus = config_.bus] { return Load(path, bus); }),
      obstacles_(config),
      state_(config.robot.start),
      measured_(state_),
      supervisor_(SupervisorOptionsOf(config_), *this) {
  RequireSize(config, "robot.start", state_.size(), config.problem->model->num_states());
  if (!config.planner.goal.empty())
    RequireSize(config, "planner.goal", config.planner.goal.size(), config.problem->projection.rows());
  bus.Subscribe(config_.bus.certified,
                [this](const Received& received) { supervisor_.OnCertified(received.raw, received.utime); });
  bus.Subscribe(config_.bus.withdrawn, [this](const Received& received) {
    heard_utime_ = received.utime;
    supervisor_.OnWithdrawn(received.raw, received.utime);
  });
  bus.Subscribe(config_.bus.fault, [this](const Received& received) {
    heard_utime_ = received.utime;
    supervisor_.OnFault(received.raw, received.utime);
  });
  bus.Subscribe(config_.bus.obstacles, [this](const Received& received) { OnObstacles(received); });
  bus.Subscribe(config_.bus.command, [this](const Received& received) {
    const std::string why = supervisor_.OnCommand(received.raw, received.utime);
    if (!why.empty()) logging::Warn("{}: refused: {}", config_.bus.command, why);
  });
}

void RobotSimNode::Tick(std::int64_t now_us) {
  TakeReload();
  if (!start_utime_) start_utime_ = now_us;
  while (!done() && due_us() <= now_us) {
    Boundary(due_us() - offset_us_, now_us);
    offset_us_ = jitter_.Next();
  }
}

std::int64_t RobotSimNode::due_us() const {
  return start_utime_.value_or(0) + supervisor_.counts().boundaries * period_us_ + offset_us_;
}

void RobotSimNode::Reload() {
  if (!reload_.Ask()) logging::Error("not reloaded: the reloads before have not ended; it is read again once one has");
}

void RobotSimNode::TakeReload() {
  const std::optional<Config> config = reload_.Take().value_or(std::nullopt);
  if (reload_.TakeStall()) logging::Error("not reloaded yet: a file that it reads does not answer");
  if (!config) return;
  ExpectTask(*config, supervisor_);
  logging::Info("plans certified under {} as it is now are accepted", config_.path);
}

void RobotSimNode::Boundary(std::int64_t utime, std::int64_t now_us) {
  const std::int64_t late_us = std::clamp(now_us - utime, -most_late_us_, most_late_us_);
  std::vector<double> control(supervisor_.control().begin(), supervisor_.control().end());
  const bool moves = !control.empty() || is_stopping_;
  if (!control.empty()) {
    is_stopping_ = false;
    inputs_.Add(control);
    const std::vector<double> z = Joined(state_, control);
    plant_(state_, control, state_, static_cast<double>(late_us - late_before_us_) * 1e-6);
    disturbance_.Add(state_, z);
  } else if (is_stopping_) {
    BrakeUntil(utime);
  }
  if (moves)
    for (const int k : config_.problem->model->angles())
      state_[ToSize(k)] = std::remainder(state_[ToSize(k)], 2 * std::numbers::pi);
  MeasureState();
  heard_utime_ = utime;
  const std::vector<double> room = LimitRoom(control);
  // First the step that ends: a contact or the goal is reported with the state that was checked.
  supervisor_.FinishStep(utime, now_us);
  ReportContacts(utime, moves);
  ReportLimits(utime, room);
  state_before_ = state_;
  ReportGoal(utime);
  const bool ends = goal_reached_ || static_cast<double>(utime - *start_utime_) >= config_.robot.time_limit_s * 1e6;
  // It stays for some boundaries, so that others hear that it has finished.
  if (supervisor_.Boundary(utime, now_us, ends).empty() && ends && !is_stopping_) ++finished_boundaries_;
  late_before_us_ = late_us;
  LogProgress(utime);
  LogRefusedStarts();
}

void RobotSimNode::MeasureState() {
  measured_ = state_;
  sensor_.Add(measured_);
}

void RobotSimNode::Hold() {
  brake_.Apply(state_, 0, state_);
  MeasureState();
  is_stopping_ = brake_.StepsToRest(state_, state_) > 0;
  brakes_since_utime_ = heard_utime_;
  if (!goal_reached_) ++stops_;
}

// The step that ends at a boundary, in which the robot comes to rest.
void RobotSimNode::BrakeUntil(std::int64_t utime) {
  const std::vector<double> before = state_;
  const Box& inputs = config_.problem->domain.input;
  // Zero is not an input of every robot.
  const Eigen::VectorXd idle = inputs.lower().cwiseMax(0).cwiseMin(inputs.upper());
  const std::span<const double> no_drive(idle.data(), ToSize(idle.size()));
  plant_(before, no_drive, state_, 0);
  disturbance_.Add(state_, Joined(before, no_drive));
  const double share = static_cast<double>(utime - brakes_since_utime_) / static_cast<double>(period_us_);
  brake_.Apply(before, std::clamp(share, 0.0, 1.0), state_);
  is_stopping_ = brake_.StepsToRest(state_, state_) > 0;
}

void RobotSimNode::Send(const std::string& channel, Bytes message) {
  if (channel == config_.bus.event && !said_refusals_)
    if (const auto event = Decoded<execution_event_t>(message); event && event->kind == execution_event_t::REFUSED)
      if (const std::string why = GetText(event->message); why.starts_with(kOutsideX0)) last_refusal_ = why;
  if (!bus_.Publish(channel, message)) throw std::runtime_error("the bus does not take it");
}

void RobotSimNode::LogProgress(std::int64_t utime) {
  if (utime < next_progress_utime_) return;
  next_progress_utime_ = utime + kProgressUs;
  logging::Info("{} steps driven, {} inside their slices, {:.1f} m to the goal{}", supervisor_.counts().steps,
                supervisor_.counts().steps_inside, DistanceToGoal(), supervisor_.control().empty() ? ", standing" : "");
}

// Plans are controls: nothing in them steers back a robot that the target or a disturbance drives off.
void RobotSimNode::LogRefusedStarts() {
  const Supervisor::Counts& counts = supervisor_.counts();
  const auto refused = counts.refused.find(std::string(kOutsideX0));
  if (said_refusals_ || refused == counts.refused.end() || refused->second < kRefusedStarts ||
      3 * refused->second < counts.started)
    return;
  said_refusals_ = true;
  logging::Warn(
      "{} plans were refused at their start and {} began: the robot is not in the set X0 where the planner expects it, "
      "brakes, and begins again. Nothing steers it back within a plan. Widen planner.initial_half_width, or let plans "
      "take over sooner (planner.lead_steps). The last: {}",
      refused->second, counts.started, last_refusal_);
}

void RobotSimNode::OnObstacles(const Received& received) {
  // What it refuses is no news: the certifier reports it.
  static_cast<void>(obstacles_.Update(received.bytes, received.utime, received.sender));
}

std::vector<Contact> RobotSimNode::Contacts(std::int64_t utime, bool moved) const {
  const Problem& problem = *config_.problem;
  const Sample now{state_, utime};
  if (!problem.between || state_before_.empty()) return FindContacts(places_, obstacles_.all(), now);
  const Between standing{Eigen::VectorXd::Zero(problem.projection.rows()), 0, 0, problem.between->period};
  return FindContacts(problem, places_, obstacles_.all(), {state_before_, utime - period_us_}, now,
                      moved ? *problem.between : standing);
}

void RobotSimNode::ReportContacts(std::int64_t utime, bool moved) {
  for (const Contact& contact : Contacts(utime, moved)) {
    ++contacts_;
    std::string text = fmt::format("inside {}", NameOf(obstacles_.all(), contact.obstacle));
    if (config_.problem->body != Body())
      text = fmt::format("part {} meets {}", contact.part, NameOf(obstacles_.all(), contact.obstacle));
    if (config_.problem->between) text += fmt::format(", {} of a step after the last sample", ToText(contact.at));
    supervisor_.Report(utime, execution_event_t::CONTACT, contact.clearance, text);
  }
}

// At this boundary, and of limits that use an input at the one before, where the control was applied first.
std::vector<double> RobotSimNode::LimitRoom(std::span<const double> control) const {
  std::vector<double> room(limits_.size()), before = room;
  limits_.Room(state_, {}, room);
  if (control.empty()) return room;
  limits_.Room(state_before_, control, before);
  for (std::size_t i = 0; i < room.size(); ++i)
    if (limits_.UsesInput(i)) room[i] = before[i];
  return room;
}

void RobotSimNode::ReportLimits(std::int64_t utime, std::span<const double> room) {
  for (std::size_t i = 0; i < room.size(); ++i) {
    if (room[i] >= 0) continue;
    ++limits_exceeded_;
    const std::string& name = limits_[i].name;
    if (std::isfinite(room[i]))
      supervisor_.Report(utime, execution_event_t::LIMIT_EXCEEDED, -room[i],
                         fmt::format("{} is {} beyond its bound", name, ToText(-room[i])));
    else
      supervisor_.Report(utime, execution_event_t::LIMIT_EXCEEDED, 0, fmt::format("{} has no finite value", name));
  }
}

void RobotSimNode::ReportGoal(std::int64_t utime) {
  const double distance = DistanceToGoal();
  if (goal_reached_ || !(distance <= config_.planner.goal_radius)) return;
  goal_reached_ = true;
  supervisor_.Report(
      utime, execution_event_t::GOAL_REACHED, distance,
      fmt::format("{} m from the goal, it counts within {} m", ToText(distance), ToText(config_.planner.goal_radius)));
}

Eigen::VectorXd RobotSimNode::Position() const {
  return config_.problem->projection * Eigen::Map<const Eigen::VectorXd>(state_.data(), std::ssize(state_));
}

double RobotSimNode::DistanceToGoal() const {
  const std::vector<double>& goal = config_.planner.goal;
  if (goal.empty()) return std::numeric_limits<double>::quiet_NaN();
  return (Position() - Eigen::Map<const Eigen::VectorXd>(goal.data(), std::ssize(goal))).norm();
}

void RobotSimNode::Stop() { out_ << Summary() << std::endl; }

std::string RobotSimNode::Summary() const {
  const Supervisor::Counts& counts = supervisor_.counts();
  nlohmann::ordered_json summary;
  summary["boundaries"] = counts.boundaries;
  summary["steps_executed"] = counts.steps;
  summary["steps_inside_slice"] = counts.steps_inside;
  summary["steps_consistent"] = counts.steps_consistent;
  summary["contacts"] = contacts_;
  summary["limits_exceeded"] = limits_exceeded_;
  summary["goal_reached"] = goal_reached_;
  summary["distance_to_goal"] = DistanceToGoal();  // NaN becomes null
  summary["stops"] = stops_;
  summary["emergency_stops"] = counts.emergency_stops;
  summary["plans_accepted"] = counts.accepted;
  summary["plans_started"] = counts.started;
  summary["plans_refused"] = counts.refused;
  summary["messages_not_sent"] = counts.reports_lost + static_cast<std::int64_t>(supervisor_.reports_waiting());
  return JsonText(summary);
}

}  // namespace forereach
