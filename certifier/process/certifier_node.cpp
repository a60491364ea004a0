#include "certifier/process/certifier_node.h"

#include <algorithm>
#include <chrono>
#include <initializer_list>
#include <iostream>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include "certifier/gate/stamp.h"
#include "certifier/task/key.h"
#include "lcmtypes/names.h"

namespace forereach {
namespace {

constexpr int kUnindexedAtMost = 128;
// An index of so many is built in about a millisecond; of more it is built in a thread of its own.
constexpr std::size_t kIndexedAtOnce = 4096;

WatchOptions OptionsOf(const GateOptions& gate) {
  return {gate.needs_robot_state, Microseconds(gate.robot_timeout_ms), Microseconds(gate.max_clock_jump_ms)};
}

std::int64_t PageFaults() {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

// Of a candidate; of bytes that are none, never.
std::int64_t StartOf(Bytes bytes) {
  const auto candidate = Decoded<candidate_plan_t>(bytes);
  return candidate ? candidate->start_utime : std::numeric_limits<std::int64_t>::max();
}

fault_t EmptyFault(std::int16_t cause) {
  fault_t fault{};
  fault.cause = cause;
  fault.plan_id = fault.first_observation = fault.second_observation = -1;
  fault.step = fault.coordinate = -1;
  return fault;
}

}  // namespace

CertifierNode::CertifierNode(const Config& config, Bus& bus, Clocks clocks)
    : config_path_(config.path),
      channels_(WithKeys(config.bus, Role::kCertifier)),
      realtime_(config.realtime),
      clocks_(std::move(clocks)),
      bus_(bus),
      sender_(bus),
      gate_(std::make_unique<Gate>(config)),
      watch_(OptionsOf(config.gate)),
      reload_([path = config.path, channels = channels_] { return Load(path, channels); }) {
  if (const auto& violation = gate_->certifier().violation())
    spdlog::warn("observations {} and {} contradict the declaration: every candidate will be abstained from (F)",
                 violation->first, violation->second);
  if (gate_->certifier().uses_hull_distance())
    spdlog::warn("a row of the declaration has more than {} columns: set-to-sample distances are bounded over hulls",
                 LipschitzEnvelope::kMaxExactColumns);
  bus.Subscribe(channels_.candidate, [this](const Received& received) {
    queue_.push_back({{received.bytes.begin(), received.bytes.end()}});
    high_water_ = std::max(high_water_, queue_.size());
  });
  bus.Subscribe(channels_.obstacles, [this](const Received& received) { OnObstacles(received); });
  bus.Subscribe(channels_.robot_state, [this](const Received& received) { OnRobotState(received); });
  bus.Subscribe(channels_.transition, [this](const Received& received) { OnTransition(received); });
  bus.Subscribe(channels_.command, [this](const Received& received) { OnCommand(received); });
}

CertifierNode::~CertifierNode() {
  if (compaction_.valid()) compaction_.wait();  // it works on *gate_
}

// ---- What changes the grounds of decisions.

void CertifierNode::Refuse(const std::string& channel, const std::string& why) {
  ++refused_;
  const std::int64_t now = clocks_.steady();
  if (now < next_warning_us_) return;  // whoever floods the bus does not flood the log, nor wait for its reader
  next_warning_us_ = now + kHeartbeatUs;
  spdlog::warn("{}: refused: {} ({} messages in all)", channel, why, refused_);
}

void CertifierNode::OnObstacles(const Received& received) {
  const std::string error = gate_->UpdateObstacles(received.bytes, received.utime);
  if (!error.empty()) Refuse(channels_.obstacles, error + "; the obstacles in force stay");
}

void CertifierNode::OnRobotState(const Received& received) {
  robot_state_t state;
  if (Decode(received.bytes, state) != DecodeStatus::kOk) return Refuse(channels_.robot_state, "not a robot_state_t");
  const std::string error = gate_->CheckRobotState(state, received.utime);
  if (!error.empty()) return Refuse(channels_.robot_state, error);
  last_state_ = state;
  if (state.mode == robot_state_t::FINISHED) return watch_.RobotHasFinished();
  watch_.SeeRobot(received.utime);
  FailIfLeft(conformance_.Check(state));
}

void CertifierNode::FailIfLeft(const std::optional<Conformance::Departure>& departure) {
  if (!departure) return;
  fault_t fault = EmptyFault(fault_t::SLICE_LEFT);
  fault.plan_id = departure->plan_id;
  fault.step = static_cast<std::int16_t>(departure->step);
  fault.coordinate = static_cast<std::int16_t>(departure->coordinate);
  fault.value = departure->value;
  fault.lower = departure->lower;
  fault.upper = departure->upper;
  Fail(fault, fmt::format("plan {}: state coordinate {} is {} at step {}, its certified slice is [{}, {}]",
                          departure->plan_id, departure->coordinate, departure->value, departure->step,
                          departure->lower, departure->upper));
}

void CertifierNode::OnTransition(const Received& received) {
  const auto transition = Decoded<transition_t>(received.bytes);
  if (transition) last_transition_ = *transition;
  if (gate_->options().learns) Learn(received.bytes);  // first: a false declaration is why a slice is left
  if (transition) FailIfLeft(conformance_.Check(*transition));
}

void CertifierNode::Learn(Bytes transition) {
  const bool was_falsified = gate_->certifier().violation().has_value();
  const std::string error = gate_->Learn(transition);
  if (!error.empty()) return Refuse(channels_.transition, error);
  const auto& violation = gate_->certifier().violation();
  if (was_falsified || !violation) return;
  falsified_.push_back({gate_->model_digest(), gate_->certifier().Contradiction()});
  fault_t fault = EmptyFault(fault_t::DECLARATION_FALSIFIED);
  fault.coordinate = static_cast<std::int16_t>(violation->coordinate);
  fault.first_observation = violation->first;
  fault.second_observation = violation->second;
  fault.value = violation->difference;
  fault.upper = violation->bound;
  Fail(fault, fmt::format("the executed transition {} contradicts the declaration: with observation {} its residual {} "
                          "differs by {}, the declaration allows {}",
                          violation->second, violation->first, violation->coordinate, violation->difference,
                          violation->bound));
}

void CertifierNode::OnCommand(const Received& received) {
  const auto command = Decoded<command_t>(received.bytes);
  if (!command) return Refuse(channels_.command, "not a command_t");
  const std::string error = gate_->CheckFresh(command->utime, received.utime);
  if (!error.empty()) return Refuse(channels_.command, error);
  Obey(*command, received.utime);
}

void CertifierNode::Obey(const command_t& command, std::int64_t now_us) {
  switch (command.kind) {
    case command_t::RESET:
      if (watch_.fault() && IsNotAfter(command.utime, watch_.fault()->utime, now_us, gate_->options()))
        return Refuse(channels_.command, "a reset from before the fault: nobody has seen it yet");
      if (watch_.Reset()) spdlog::warn("{} has cleared the fault", GetText(command.source));
      next_heartbeat_us_ = 0;
      return;
    case command_t::RELOAD:
      return Reload();
    default:
      return Refuse(channels_.command, "unknown kind " + std::to_string(command.kind));
  }
}

// ---- Faults.

void CertifierNode::Fail(fault_t fault, const std::string& why) {
  const Watch::Fault latched{fault.cause, clocks_.wall(), why};
  if (watch_.Latch(latched)) Announce(fault, latched);
}

void CertifierNode::Announce(fault_t fault, const Watch::Fault& latched) {
  fault.utime = latched.utime;
  fault.sequence = faults_++;
  fault.state = last_state_;
  fault.transition = last_transition_;
  SetText(fault.message, latched.why);
  announced_ = fault;
  SendFault();
  spdlog::error("fault {}: {}; nothing is certified until `forereach reset`", FaultName(latched.cause), latched.why);
  next_heartbeat_us_ = 0;
}

void CertifierNode::SendFault() {
  next_announcement_us_ = clocks_.steady() + kHeartbeatUs;
  sender_.Send(channels_.fault, announced_);
}

// ---- Candidates.

void CertifierNode::Tick(std::int64_t now_us) {
  if (heartbeats_ == 0) Heartbeat(now_us);  // says that nothing has been decided or learned yet
  if (const auto fault = watch_.Advance(now_us, clocks_.steady())) Announce(EmptyFault(fault->cause), *fault);
  TakeReload();
  AnswerWaiting();
  CompactIfDue();
  if (clocks_.steady() >= next_heartbeat_us_) Heartbeat(now_us);
}

void CertifierNode::AnswerWaiting() {
  for (int i = 0; i < kAtOnce && !queue_.empty(); ++i) {
    const Waiting newest = std::move(queue_.back());
    queue_.pop_back();
    Answer(newest.candidate, false);
    AnswerDue();
  }
  const auto most = static_cast<std::size_t>(gate_->options().queue);
  for (int i = 1; queue_.size() > most; ++i) {
    const Waiting oldest = std::move(queue_.front());
    queue_.pop_front();
    Answer(oldest.candidate, true);
    if (i % kAtOnce == 0) AnswerDue();  // a flood takes longer to answer than the kept ones have
  }
}

// Those for which another decision would take too long: while their start has not passed.
void CertifierNode::AnswerDue() {
  for (Waiting& waiting : queue_)
    if (!waiting.start_utime) waiting.start_utime = StartOf(waiting.candidate);
  const std::int64_t last_start = clocks_.wall() + Microseconds(gate_->options().decision_budget_ms);
  std::erase_if(queue_, [&](const Waiting& waiting) {
    if (*waiting.start_utime >= last_start) return false;
    Answer(waiting.candidate, false);
    return true;
  });
}

GateAnswer CertifierNode::Decide(Bytes candidate) {
  switch (watch_.state()) {
    case Watch::State::kDisarmed:
      return gate_->Refuse(candidate, clocks_.wall(), decision_t::CAUSE_NOT_ARMED, "the robot's state is not known yet");
    case Watch::State::kFault:
      return gate_->Refuse(candidate, clocks_.wall(), decision_t::CAUSE_FAULT, "fault: " + watch_.fault()->why);
    case Watch::State::kArmed:
      break;
  }
  const std::int64_t before = PageFaults();
  GateAnswer answer = gate_->Decide(candidate, clocks_.wall);
  if (decided_ > 0) page_faults_ += PageFaults() - before;
  return answer;
}

void CertifierNode::Answer(Bytes candidate, bool displaced) {
  const auto begin = std::chrono::steady_clock::now();
  GateAnswer answer = displaced ? gate_->Refuse(candidate, clocks_.wall(), decision_t::CAUSE_QUEUE_FULL,
                                                "newer candidates displaced it from the queue")
                                : Decide(candidate);
  const std::chrono::duration<double, std::micro> elapsed = std::chrono::steady_clock::now() - begin;
  answer.decision.elapsed_us = elapsed.count();

  if (answer.certified) sender_.Send(channels_.certified, *answer.certified);
  sender_.Send(channels_.decision, answer.decision);
  if (answer.certified) conformance_.Remember(*answer.certified);
  elapsed_us_[decided_++ % elapsed_us_.size()] = elapsed.count();
}

// ---- Work beside.

void CertifierNode::CompactIfDue() {
  if (gate_->certifier().num_unindexed() < kUnindexedAtMost) return;
  if (gate_->certifier().num_observations() <= kIndexedAtOnce) return gate_->Compact();
  if (compaction_.valid() && !IsReady(compaction_)) return;
  compaction_ = Beside([gate = gate_.get()] { gate->Compact(); });
}

void CertifierNode::Reload() { reload_.Ask(); }

CertifierNode::Loaded CertifierNode::Load(const std::string& path, const BusOptions& in_force) try {
  spdlog::info("reloading {}", path);
  Loaded loaded{LoadConfig(path), nullptr, ""};
  loaded.error = WhyKeyCannotChange(in_force, loaded.config.bus, Role::kCertifier);
  if (!loaded.error.empty()) loaded.error = path + ": " + loaded.error;
  loaded.gate = std::make_unique<Gate>(loaded.config);
  return loaded;
} catch (const std::exception& error) {
  return {{}, nullptr, error.what()};
}

std::string CertifierNode::WhyNotTaken(const Config& config) const {
  const Problem &before = gate_->certifier().problem(), &after = *config.problem;
  BusOptions bus = config.bus;
  bus.url = channels_.url;  // a command line may have given another
  bus.key = channels_.key, bus.keys = channels_.keys, bus.key_is_given = channels_.key_is_given;  // Load compares keys
  for (const auto& [changes, what] : std::initializer_list<std::pair<bool, const char*>>{
           {bus.name != channels_.name, "bus.name"},
           {bus != channels_, "bus.channels"},
           {config.realtime != realtime_, "realtime"},
           {after.model->num_states() != before.model->num_states(), "the number of states"},
           {after.model->num_inputs() != before.model->num_inputs(), "the number of inputs"},
           {after.projection.rows() != before.projection.rows(), "the number of safety coordinates"}})
    if (changes) return config.path + ": " + what + " cannot change while the certifier runs";
  // What the robot has shown is not forgotten by reading a file.
  for (const Falsified& falsified : falsified_)
    if (falsified.model == config.model_digest && FindViolation(after.declaration, falsified.pair))
      return config.path + ": a transition that was executed contradicts its declaration; another has to be declared";
  return "";
}

void CertifierNode::TakeReload() {
  if (compaction_.valid() && !IsReady(compaction_)) return;  // it works on *gate_
  std::optional<Loaded> loaded = reload_.Take();
  if (!loaded) return;
  reload_error_ = loaded->error.empty() ? WhyNotTaken(loaded->config) : loaded->error;
  next_heartbeat_us_ = 0;
  if (!reload_error_.empty()) {
    ++failed_reloads_;
    return spdlog::error("not reloaded, version {} stays in force: {}", version_, reload_error_);
  }
  loaded->gate->Inherit(*gate_);
  gate_ = std::move(loaded->gate);
  watch_.Follow(OptionsOf(gate_->options()));
  spdlog::info("version {} of {} is in force", ++version_, config_path_);
}

// ---- The heartbeat.

std::string CertifierNode::WhyNotOk() const {
  if (watch_.fault()) return std::string(FaultName(watch_.fault()->cause)) + ": " + watch_.fault()->why;
  if (gate_->certifier().violation()) return "the observations contradict the declaration: every candidate is F";
  if (!reload_error_.empty()) return "the last reload failed: " + reload_error_;
  return watch_.state() == Watch::State::kDisarmed ? "waits for the robot's state" : "";
}

void CertifierNode::Heartbeat(std::int64_t now_us) {
  next_heartbeat_us_ = clocks_.steady() + kHeartbeatUs;
  certifier_status_v2_t status = gate_->Status(now_us);
  const bool error = watch_.fault() || gate_->certifier().violation();
  status.sequence = heartbeats_++;
  status.state = static_cast<std::int16_t>(watch_.state());
  status.level = error ? certifier_status_v2_t::ERROR
                 : watch_.state() == Watch::State::kArmed ? certifier_status_v2_t::OK : certifier_status_v2_t::STALE;
  if (watch_.fault()) {
    status.fault = watch_.fault()->cause;
    status.fault_utime = watch_.fault()->utime;
  }
  status.version = version_;
  status.failed_reloads = failed_reloads_;
  status.messages_refused = refused_;
  status.messages_not_sent = sender_.refused();
  status.bus_dropped = bus_.dropped();
  const Refusals refusals = bus_.refusals();
  status.refused_unsigned = refusals.unsigned_ones;
  status.refused_forged = refusals.forged + refusals.foreign;
  status.refused_replayed = refusals.replayed;
  status.page_faults = page_faults_;
  status.queue_depth = static_cast<std::int32_t>(queue_.size());
  status.queue_high_water = static_cast<std::int32_t>(std::exchange(high_water_, queue_.size()));
  status.elapsed_p50_us = ElapsedPercentile(0.5);
  status.elapsed_p99_us = ElapsedPercentile(0.99);
  status.elapsed_max_us = ElapsedPercentile(1);
  SetText(status.message, WhyNotOk());
  // First what a robot that has just begun has to know, then what a person reads and resets.
  if (watch_.fault() && clocks_.steady() >= next_announcement_us_) SendFault();
  sender_.Send(channels_.status, status);
}

double CertifierNode::ElapsedPercentile(double fraction) const {
  const std::size_t count = std::min(decided_, elapsed_us_.size());
  if (count == 0) return 0;
  auto sorted = elapsed_us_;
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(count - 1));
  std::nth_element(sorted.begin(), at, sorted.begin() + static_cast<std::ptrdiff_t>(count));
  return *at;
}

void CertifierNode::Stop() {
  while (!queue_.empty()) AnswerWaiting();
  const certifier_status_v2_t status = gate_->Status(0);
  const auto count = [&](std::int16_t outcome) { return status.by_outcome[outcome]; };
  std::cout << nlohmann::json{{"candidates", status.candidates},
                              {"certified", count(decision_t::CERTIFIED)},
                              {"abstained", {{"falsified", count(decision_t::ABSTAIN_FALSIFIED)},
                                             {"domain", count(decision_t::ABSTAIN_DOMAIN)},
                                             {"safety", count(decision_t::ABSTAIN_SAFETY)},
                                             {"deadline", count(decision_t::ABSTAIN_DEADLINE)}}},
                              {"rejected", count(decision_t::REJECTED)},
                              {"observations", status.observations},
                              {"learned", status.learned},
                              {"faults", faults_},
                              {"messages_refused", refused_},
                              {"messages_not_sent", sender_.refused()},
                              {"elapsed_us", {{"p50", ElapsedPercentile(0.5)}, {"p99", ElapsedPercentile(0.99)}}}}
            << std::endl;
}

}  // namespace forereach
