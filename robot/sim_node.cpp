#include "robot/sim_node.h"

#include <algorithm>
#include <array>
#include <limits>

#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include "certifier/gate/stamp.h"
#include "certifier/numerics/text.h"
#include "certifier/task/key.h"
#include "forereach/command_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "lcmtypes/names.h"

namespace forereach {
namespace {

constexpr std::int64_t kProgressUs = 1'000'000;

std::optional<Config> Load(const std::string& path, const BusOptions& in_force) try {
  Config config = LoadConfig(path);
  const std::string why = WhyKeyCannotChange(in_force, config.bus, Role::kRobot);
  if (!why.empty()) throw ConfigError(path + ": " + why);
  return config;
} catch (const std::exception& error) {
  spdlog::error("not reloaded: {}", error.what());
  return std::nullopt;
}

GuardDomain DomainOf(const Config& config) {
  const auto entries = [](const Eigen::VectorXd& bounds) { return std::vector<double>(bounds.begin(), bounds.end()); };
  const Domain& domain = config.problem->domain;
  return {entries(domain.state.lower()), entries(domain.state.upper()), entries(domain.input.lower()),
          entries(domain.input.upper())};
}

GuardOptions OptionsOf(const Config& config) {
  GuardOptions options;
  options.num_states = config.problem->model->num_states();
  options.num_inputs = config.problem->model->num_inputs();
  options.step_us = Microseconds(config.robot.step_period_ms);
  options.config_digest = config.digest;
  options.model_digest = config.model_digest;
  options.keys = KeysOf(config.bus, Role::kRobot);
  options.bus_name = config.bus.bus_name();
  options.channel = config.bus.certified;
  options.domain = DomainOf(config);
  return options;
}

std::vector<int> RestCoordinates(const NominalModel& model) {
  constexpr std::array<std::string_view, 4> kMotion{"v", "a", "vx", "vy"};
  std::vector<int> rest;
  for (int k = 0; k < model.num_states(); ++k) {
    const std::string& name = model.state_names()[static_cast<std::size_t>(k)];
    if (std::find(kMotion.begin(), kMotion.end(), name) != kMotion.end()) rest.push_back(k);
  }
  return rest;
}

Config WithKeysOfRobot(Config config) {
  config.bus = WithKeys(std::move(config.bus), Role::kRobot);
  return config;
}

void RequireSize(const Config& config, const char* key, std::size_t size, std::int64_t expected) {
  if (static_cast<std::int64_t>(size) != expected)
    throw ConfigError(config.path + ": " + key + ": " + std::to_string(size) + " entries, it has to have " +
                      std::to_string(expected));
}

}  // namespace

RobotSimNode::RobotSimNode(const Config& config, Bus& bus, std::ostream& out)
    : config_(WithKeysOfRobot(config)),
      sender_(bus),
      out_(out),
      target_(MakeTarget(config)),
      period_us_(Microseconds(config.robot.step_period_ms)),
      guard_(OptionsOf(config_)),
      rest_coordinates_(RestCoordinates(*config.problem->model)),
      reload_([path = config.path, bus = config_.bus] { return Load(path, bus); }),
      state_(config.robot.start) {
  RequireSize(config, "robot.start", state_.size(), config.problem->model->num_states());
  if (!config.planner.goal.empty())
    RequireSize(config, "planner.goal", config.planner.goal.size(), config.problem->projection.rows());
  bus.Subscribe(config_.bus.certified, [this](const Received& received) { OnCertified(received); });
  bus.Subscribe(config_.bus.fault, [this](const Received& received) { OnFault(received); });
  bus.Subscribe(config_.bus.command, [this](const Received& received) { OnCommand(received); });
}

void RobotSimNode::Tick(std::int64_t now_us) {
  TakeReload();
  if (!start_utime_) start_utime_ = now_us;
  while (!done() && *start_utime_ + boundaries_ * period_us_ <= now_us)
    Boundary(*start_utime_ + boundaries_ * period_us_, now_us);
}

void RobotSimNode::OnCertified(const Received& received) {
  const GuardVerdict verdict = guard_.Accept(received.raw, received.utime);
  if (!verdict.ok()) return PublishRefusal(received.utime, verdict);
  ++accepted_;
  PublishEvent(received.utime, execution_event_t::ACCEPTED, verdict.plan_id, -1, 0, "the plan waits for its start");
}

void RobotSimNode::OnFault(const Received& received) {
  const auto fault = Decoded<fault_t>(received.bytes);
  if (!fault || !StopsTheRobot(fault->cause)) return;
  // The certifier repeats a fault until it hears the reset, which the robot may have heard before.
  if (IsNotAfter(fault->utime, reset_utime_, received.utime, config_.gate)) return;
  halted_utime_ = fault->utime;
  if (guard_.halted()) return;
  const std::int64_t plan_id = executing_plan_id();
  const int step = executing_step();
  if (executing()) Stand();
  guard_.Halt();
  PublishEvent(received.utime, execution_event_t::HALTED, plan_id, step, 0,
               "emergency stop: " + GetText(fault->message));
}

void RobotSimNode::OnCommand(const Received& received) {
  const auto command = Decoded<command_t>(received.bytes);
  if (!command) return;
  if (const Stamp stamp = Judge(command->utime, received.utime, config_.gate); !stamp.fault.empty())
    return spdlog::warn("{}: refused: {}", config_.bus.command, stamp.fault);
  if (command->kind == command_t::RELOAD) return Reload();
  if (command->kind != command_t::RESET) return;
  if (guard_.halted() && IsNotAfter(command->utime, halted_utime_, received.utime, config_.gate))
    return spdlog::warn("{}: refused: a reset from before the robot was halted", config_.bus.command);
  reset_utime_ = std::min(command->utime, received.utime);  // a clock that goes ahead clears no fault to come
  if (!guard_.halted()) return;
  guard_.Reset();
  PublishEvent(received.utime, execution_event_t::RESET, -1, -1, 0, GetText(command->source) + " lets it go on");
}

void RobotSimNode::Reload() {
  if (!reload_.Ask()) spdlog::error("not reloaded: the reloads before have not ended; it is read again once one has");
}

void RobotSimNode::TakeReload() {
  const std::optional<Config> config = reload_.Take().value_or(std::nullopt);
  if (reload_.TakeStall()) spdlog::error("not reloaded yet: a file that it reads does not answer");
  if (!config) return;
  guard_.Expect(config->digest, config->model_digest, DomainOf(*config));
  spdlog::info("plans certified under {} as it is now are accepted", config_.path);
}

void RobotSimNode::Boundary(std::int64_t utime, std::int64_t now_us) {
  if (executing()) FinishStep(utime, now_us);
  ReportContacts(utime);
  ReportGoal(utime);
  ending_ = goal_reached_ || static_cast<double>(utime - *start_utime_) >= config_.robot.time_limit_s * 1e6;
  if (!ending_) StartPending(utime, now_us);
  if (executing()) ContinuePlan(utime);
  PublishState(utime);
  ++boundaries_;
  LogProgress(utime);
}

void RobotSimNode::LogProgress(std::int64_t utime) {
  if (utime < next_progress_utime_) return;
  next_progress_utime_ = utime + kProgressUs;
  spdlog::info("{} steps driven, {} inside their slices, {:.1f} m to the goal{}", transitions_, steps_inside_,
               DistanceToGoal(), executing() ? "" : ", standing");
}

void RobotSimNode::FinishStep(std::int64_t utime, std::int64_t now_us) {
  const candidate_plan_t& plan = guard_.executing()->plan;
  const std::int64_t plan_id = plan.plan_id;
  const std::span<const double> control(plan.control[step_], static_cast<std::size_t>(plan.num_inputs));
  std::vector<double> next(state_.size());
  target_->Step(state_, control, next);
  PublishTransition(utime - period_us_, control, next);
  state_ = std::move(next);
  ++step_;

  const GuardVerdict verdict = guard_.Check(step_, state_);
  if (verdict.ok()) {
    ++steps_inside_;
    PublishEvent(utime, execution_event_t::STEP_INSIDE, plan_id, step_, 0, "inside the certified slice");
    return;
  }
  PublishEvent(utime, execution_event_t::STEP_OUTSIDE, plan_id, step_, verdict.value,
               "emergency stop: " + verdict.message, verdict.coordinate);
  halted_utime_ = now_us;
  Stand();
}

void RobotSimNode::ReportContacts(std::int64_t utime) {
  for (std::size_t o = 0; o < config_.obstacles.size(); ++o) {
    const double clearance = ApproximateDistance(config_.obstacles[o], Position());
    if (!(clearance <= 0)) continue;
    ++contacts_;
    PublishEvent(utime, execution_event_t::CONTACT, executing_plan_id(), executing_step(), clearance,
                 "inside obstacle " + std::to_string(o));
  }
}

void RobotSimNode::ReportGoal(std::int64_t utime) {
  const double distance = DistanceToGoal();
  if (goal_reached_ || !(distance <= config_.planner.goal_radius)) return;
  goal_reached_ = true;
  PublishEvent(utime, execution_event_t::GOAL_REACHED, executing_plan_id(), executing_step(), distance,
               ToText(distance) + " m from the goal, it counts within " + ToText(config_.planner.goal_radius) + " m");
}

void RobotSimNode::StartPending(std::int64_t utime, std::int64_t now_us) {
  if (guard_.pending() == nullptr) return;
  const GuardVerdict verdict = guard_.TryStart(utime, now_us, state_);
  if (verdict.cause == GuardCause::kTooEarly) return;
  if (!verdict.ok()) return PublishRefusal(utime, verdict);
  step_ = 0;
  ++started_;
  PublishEvent(utime, execution_event_t::STARTED, verdict.plan_id, 0, 0,
               std::to_string(guard_.executing()->plan.num_steps) + " steps");
}

void RobotSimNode::ContinuePlan(std::int64_t utime) {
  const candidate_plan_t& plan = guard_.executing()->plan;
  if (step_ == plan.num_steps) {
    PublishEvent(utime, execution_event_t::STANDING, plan.plan_id, step_, 0, "the plan is finished: holding still");
    Stand();
  } else if (step_ == plan.progress_steps) {
    PublishEvent(utime, execution_event_t::TAIL_BEGUN, plan.plan_id, step_, 0, "no newer certificate: braking");
  }
}

void RobotSimNode::Stand() {
  guard_.Finish();
  for (const int k : rest_coordinates_) state_[static_cast<std::size_t>(k)] = 0;
  if (!goal_reached_) ++stops_;
}

void RobotSimNode::PublishState(std::int64_t utime) {
  robot_state_t message{};
  message.utime = utime;
  message.sequence = boundaries_;
  message.executing_plan_id = executing_plan_id();
  message.executing_step = static_cast<std::int16_t>(executing_step());
  message.mode = executing() ? robot_state_t::EXECUTING : ending_ ? robot_state_t::FINISHED : robot_state_t::STANDING;
  message.num_states = static_cast<std::int16_t>(state_.size());
  std::copy(state_.begin(), state_.end(), message.state);
  sender_.Send(config_.bus.robot_state, message);
  if (message.mode == robot_state_t::FINISHED) ++finished_boundaries_;
}

void RobotSimNode::PublishTransition(std::int64_t utime, std::span<const double> control,
                                     std::span<const double> next) {
  transition_t message{};
  message.utime = utime;
  message.sequence = transitions_++;
  message.num_states = static_cast<std::int16_t>(state_.size());
  message.num_inputs = static_cast<std::int16_t>(control.size());
  std::copy(state_.begin(), state_.end(), message.state);
  std::copy(control.begin(), control.end(), message.input);
  std::copy(next.begin(), next.end(), message.next_state);
  sender_.Send(config_.bus.transition, message);
}

void RobotSimNode::PublishRefusal(std::int64_t utime, const GuardVerdict& verdict) {
  const std::string cause(GuardCauseName(verdict.cause));
  ++refused_[cause];
  PublishEvent(utime, execution_event_t::REFUSED, verdict.plan_id, verdict.step, verdict.value,
               cause + ": " + verdict.message, verdict.coordinate);
}

void RobotSimNode::PublishEvent(std::int64_t utime, std::int16_t kind, std::int64_t plan_id, int step, double value,
                                std::string_view text, int coordinate) {
  execution_event_t message{};
  message.utime = utime;
  message.sequence = events_++;
  message.plan_id = plan_id;
  message.kind = kind;
  message.step = static_cast<std::int16_t>(step);
  message.coordinate = static_cast<std::int16_t>(coordinate);
  message.num_states = static_cast<std::int16_t>(state_.size());
  std::copy(state_.begin(), state_.end(), message.state);
  message.value = value;
  SetText(message.message, text);
  sender_.Send(config_.bus.event, message);
}

Eigen::VectorXd RobotSimNode::Position() const {
  return config_.problem->projection * Eigen::Map<const Eigen::VectorXd>(state_.data(), std::ssize(state_));
}

double RobotSimNode::DistanceToGoal() const {
  const std::vector<double>& goal = config_.planner.goal;
  if (goal.empty()) return std::numeric_limits<double>::quiet_NaN();
  return (Position() - Eigen::Map<const Eigen::VectorXd>(goal.data(), std::ssize(goal))).norm();
}

std::int64_t RobotSimNode::executing_plan_id() const { return executing() ? guard_.executing()->plan.plan_id : -1; }

void RobotSimNode::Stop() { out_ << Summary() << std::endl; }

std::string RobotSimNode::Summary() const {
  nlohmann::ordered_json summary;
  summary["boundaries"] = boundaries_;
  summary["steps_executed"] = transitions_;
  summary["steps_inside_slice"] = steps_inside_;
  summary["contacts"] = contacts_;
  summary["goal_reached"] = goal_reached_;
  summary["distance_to_goal"] = DistanceToGoal();  // NaN becomes null
  summary["stops"] = stops_;
  summary["plans_accepted"] = accepted_;
  summary["plans_started"] = started_;
  summary["plans_refused"] = refused_;
  summary["messages_not_sent"] = sender_.refused();
  return summary.dump();
}

}  // namespace forereach
