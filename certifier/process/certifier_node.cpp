#include "certifier/process/certifier_node.h"

#include <algorithm>
#include <chrono>
#include <iostream>
#include <random>

#include <fmt/core.h>
#include <sys/resource.h>

#include "bus/bus_options.h"
#include "bus/log.h"
#include "certifier/gate/robot_messages.h"
#include "certifier/gate/stamp.h"
#include "certifier/process/faults.h"
#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/freshness.h"
#include "lcmtypes/names.h"

namespace forereach {
namespace {

// Every decision looks at each observation that is in no index yet.
constexpr int kUnindexedAtMost = 128;
constexpr std::int64_t kWarmUs = 1000;
// An index of so many is built in about a millisecond; of more it is built in a thread of its own.
constexpr std::size_t kIndexedAtOnce = 4096;

WatchOptions OptionsOf(const Config& config) {
  const GateOptions& gate = config.gate;
  return {gate.needs_robot_state, Microseconds(gate.robot_timeout_ms), Microseconds(gate.max_clock_jump_ms),
          ClockBoundsOf(config)};
}

std::int64_t PageFaults() {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

Config Checked(const Config& config) {
  RequireForCertifyingOnBus(config);
  return config;
}

std::int64_t RandomInstance() {
  std::random_device random;
  // Not negative, and never 0, which in a heartbeat means none.
  const std::uint64_t bits = std::uint64_t{random()} << 32 | random();
  return static_cast<std::int64_t>(bits >> 1) | 1;
}

Charge::State ChargeOf(std::int16_t state) {
  switch (state) {
    case certifier_status_t::LISTENING: return Charge::State::kListening;
    case certifier_status_t::STANDBY: return Charge::State::kStandingBy;
    default: return Charge::State::kInCharge;
  }
}

}  // namespace

CertifierNode::CertifierNode(const Config& config, Bus& bus, Clocks clocks, std::int64_t listen_us,
                             std::unique_ptr<LatchFile> latch)
    : config_(Checked(config)),
      channels_(WithKeys(config.bus, Role::kCertifier)),
      clocks_(std::move(clocks)),
      bus_(bus),
      sender_(bus),
      gate_(std::make_unique<Gate>(config)),
      watch_(OptionsOf(config)),
      charge_({clocks_.wall(), RandomInstance(), config.gate.shadow}, listen_us),
      has_begun_(is_in_charge()),
      plans_(config.gate, clocks_.steady()),
      robot_(Microseconds(config.gate.robot_timeout_ms)),
      transitions_(robot_),
      events_(robot_),
      advice_(clocks_.steady),
      reload_(config.path, channels_),
      contradictions_(config_),
      latch_(watch_, contradictions_, std::move(latch)),
      reporter_({channels_, bus_, sender_, watch_, charge_, contradictions_, latch_, reload_, queue_}) {
  if (config.gate.shadow) logging::Warn(kShadowWarning);
  if (gate_->certifier().problem().rest.empty() && config.gate.needs_robot_state)
    logging::Warn("plans that end moving are certified: the task does not say what standing is (task.rest)");
  if (config.left_out > 0)
    logging::Warn(
        "{} transitions of the task are left out: within declaration.state_error and declaration.input_error they may "
        "be outside the domain",
        config.left_out);
  if (const auto& violation = gate_->certifier().violation())
    logging::Warn("{}: every candidate will be answered ABSTAIN_FALSIFIED (F)",
                  violation->second < 0 ? fmt::format("transition {} contradicts a declared bound", violation->first)
                                        : fmt::format("observations {} and {} contradict the declaration",
                                                      violation->first, violation->second));
  if (gate_->certifier().uses_hull_distance())
    logging::Warn("a row of the declaration has more than {} columns: set-to-sample distances are bounded over hulls",
                  LipschitzEnvelope::kMaxExactColumns);
  bus.Subscribe(channels_.status, [this](const Received& received) { OnStatus(received); });
  bus.Subscribe(channels_.fault, [this](const Received& received) { OnFault(received); });
  bus.Subscribe(channels_.candidate, [this](const Received& received) { OnCandidate(received); });
  bus.Subscribe(channels_.obstacles, [this](const Received& received) { OnObstacles(received); });
  bus.Subscribe(channels_.robot_state, [this](const Received& received) { OnRobotState(received); });
  bus.Subscribe(channels_.transition, [this](const Received& received) { OnTransition(received); });
  bus.Subscribe(channels_.event, [this](const Received& received) { OnEvent(received); });
  bus.Subscribe(channels_.command, [this](const Received& received) { OnCommand(received); });
}

CertifierNode::~CertifierNode() {
  if (compaction_.valid()) compaction_.wait();  // it works on *gate_
}

// ---- Who is in charge.

void CertifierNode::OnStatus(const Received& received) {
  const auto status = Decoded<certifier_status_t>(received.bytes);
  if (!status || status->instance == charge_.self().instance) return;
  // Two certifiers must see each other even if their clocks disagree. Messages of a replayed log must not count.
  if (FreshnessOf(status->utime, received.utime, kCertifiersApartUs, kCertifiersApartUs) != Freshness::kFresh)
    return Refuse(channels_.status, "a heartbeat from another time");
  LookAtCharge();
  const Charge::State before = charge_.state(), its_state = ChargeOf(status->state);
  charge_.Hear({status->started_utime, status->instance, status->shadow != 0}, its_state);
  if (its_state == Charge::State::kInCharge) Heed(*status);
  FollowCharge(before);
  if (is_in_charge()) reporter_.HurryToOthers();
}

// Notes the fault and the contradictions of the certifier in charge, for the case that this one takes over.
void CertifierNode::Heed(const certifier_status_t& status) {
  fault_of_other_.reset();
  if (status.fault != 0 && status.shadow == 0)
    fault_of_other_ = Watch::Fault{status.fault, status.fault_utime, GetText(status.message)};
  // Without a fault, ERROR means that data contradict its declaration or that it cannot store a fault.
  const bool is_false = status.fault == fault_t::DECLARATION_FALSIFIED ||
                        (status.fault == 0 && status.level == certifier_status_t::ERROR &&
                         status.latch != certifier_status_t::LATCH_UNWRITABLE);
  if (is_false) contradictions_.AddReported(GetDigest(status.model_digest), GetDigest(status.declaration_digest));
}

// A FAULT message may be the last one that the certifier in charge sends.
void CertifierNode::OnFault(const Received& received) {
  if (is_in_charge()) return;  // its own
  const auto fault = Decoded<fault_t>(received.bytes);
  if (!fault) return Refuse(channels_.fault, "not a fault_t");
  fault_of_other_ = Watch::Fault{fault->cause, fault->utime, GetText(fault->message)};
}

// Called before a message is processed: a paused process may have been replaced, and it receives the queued messages
// first.
void CertifierNode::LookAtCharge() {
  watch_.Run(clocks_.wall(), clocks_.steady());
  const Charge::State before = charge_.state();
  charge_.Advance(clocks_.steady());
  FollowCharge(before);
}

void CertifierNode::FollowCharge(Charge::State before) {
  watch_.Set(Watch::Need::kCharge, WhyNotInCharge());
  if (charge_.state() == before) return;
  reporter_.Hurry();
  if (charge_.state() == Charge::State::kStandingBy) StandBy();
  if (is_in_charge()) TakeCharge();
}

std::string CertifierNode::WhyNotInCharge() const {
  switch (charge_.state()) {
    case Charge::State::kListening: return "listens whether another certifier is on this bus";
    case Charge::State::kStandingBy:
      if (!charge_.other()) return "another certifier was in charge on this bus, and has fallen silent";
      return fmt::format("another certifier, instance {:016x}, is in charge on this bus: this one decides nothing",
                         charge_.other()->instance);
    case Charge::State::kInCharge: break;
  }
  return "";
}

void CertifierNode::TakeCharge() {
  logging::Info("in charge, as instance {:016x}", charge_.self().instance);
  has_begun_ = true;
  plans_.TolerateIssuedUntil(clocks_.steady());
  if (fault_of_other_)
    Fail(PlainFault(fault_of_other_->cause,
                    fmt::format("latched by the certifier that was in charge before: {}", fault_of_other_->why)));
  else if (contradictions_.WasReported(config_))
    Fail(
        PlainFault(fault_t::DECLARATION_FALSIFIED, "the certifier that was in charge before has seen it contradicted"));
  fault_of_other_.reset();
}

// Forgets learned transitions and received messages, because another certifier has been in charge since. Keeps
// contradictions.
void CertifierNode::StandBy() {
  logging::Warn("{}", WhyNotInCharge());
  LeaveWaiting();
  ForgetRobot();
  plans_.StandBy();
  robot_ = transitions_ = events_ = SoleSender(Microseconds(gate_->options().robot_timeout_ms));
  if (!std::exchange(has_begun_, false) || gate_->certifier().violation()) return;
  if (compaction_.valid()) compaction_.wait();  // it works on *gate_
  gate_ = std::make_unique<Gate>(config_);
  reporter_.Restart();
}

void CertifierNode::LeaveWaiting() { reporter_.counts.left_to_other += static_cast<std::int64_t>(queue_.Clear()); }

void CertifierNode::OnCandidate(const Received& received) {
  if (charge_.state() == Charge::State::kStandingBy) {
    ++reporter_.counts.left_to_other;
    return;
  }
  queue_.Add(received.bytes);
  // While it listens it may yet be in charge, so it holds a few and leaves the oldest to the other.
  if (is_in_charge() || queue_.size() <= kHeldAtMost) return;
  (void)queue_.TakeOldest();
  ++reporter_.counts.left_to_other;
}

// ---- Messages that change the inputs of decisions.

void CertifierNode::Refuse(const std::string& channel, const std::string& why) {
  ++reporter_.counts.refused;
  const std::int64_t now = clocks_.steady();
  if (now < next_warning_us_) return;  // a flood of messages must not flood the log
  next_warning_us_ = now + kHeartbeatUs;
  logging::Warn("{}: refused: {} ({} messages in all)", channel, why, reporter_.counts.refused);
}

void CertifierNode::OnObstacles(const Received& received) {
  LookAtCharge();
  if (!has_begun_) return;
  const std::string error = gate_->UpdateObstacles(received.bytes, received.utime, received.sender);
  LookForObstacles(received.utime);
  if (error.empty()) return;
  reporter_.counts.obstacles_refused = true;
  Refuse(channels_.obstacles, error);
}

void CertifierNode::LookForObstacles(std::int64_t now_us) {
  std::string why = gate_->WhyObstaclesUnknown(now_us);
  if (const auto& arrival = gate_->obstacles_arrival(); arrival && !why.empty())
    why += watch_.pauses().Explain(arrival->utime, Microseconds(gate_->options().obstacles_timeout_ms));
  watch_.Set(Watch::Need::kObstacles, why.empty() ? "" : fmt::format("waits for {}: {}", channels_.obstacles, why));
  LookAtStamps();
}

void CertifierNode::ForgetRobot() {
  watch_.RobotHasFinished();
  robot_arrival_.reset();
  LookAtStamps();
}

void CertifierNode::OnRobotState(const Received& received) {
  LookAtCharge();
  if (!has_begun_) return;
  if (robot_.Hear(received.sender, received.utime) == SoleSender::Place::kTakesOver) plans_.RobotHasChanged();
  LookAtRobot(received.utime);  // a second one is there, whatever its message is
  robot_state_t state;
  if (Decode(received.bytes, state) != DecodeStatus::kOk) return Refuse(channels_.robot_state, "not a robot_state_t");
  if (FaultOf(state, config_.problem->model->num_states()).empty()) {
    robot_arrival_ = {state.utime, received.utime};
    LookAtStamps();
  }
  const std::string error = gate_->CheckRobotState(state, received.utime);
  if (!error.empty()) return Refuse(channels_.robot_state, error);
  last_state_ = state;
  const bool is_one = robot_.WhyTwo(received.utime).empty();  // of two, nobody knows which one executes a plan
  if (is_in_charge() && !gate_->options().shadow) SeeWhatRobotExecutes(state, is_one);
  if (state.mode != robot_state_t::FINISHED)
    watch_.SeeRobot(received.utime);
  else if (is_one)
    ForgetRobot();
  LookAtRobot(received.utime);
  // Such a state names no slice.
  if (state.mode == robot_state_t::FINISHED) return;
  if (!is_in_charge()) return;  // the robot may execute another's plans
  if (const auto departure = plans_.FindDeparture(state, received.sender)) Fail(SliceLeft(*departure));
  // In shadow mode another certifier decides which plans the robot executes.
  const auto stranger = plans_.FindStranger(state, clocks_.steady());
  if (stranger && !gate_->options().shadow) Fail(UncertifiedPlan(*stranger));
}

void CertifierNode::SeeWhatRobotExecutes(const robot_state_t& state, bool is_one) {
  if (is_one)
    plans_.SeeRobot(state, clocks_.steady());
  else
    plans_.SeeOneOfTwo(state, clocks_.steady());
}

// What was seen of the robot counts if one sender sends it.
void CertifierNode::LookAtRobot(std::int64_t now_us) {
  const std::string why = gate_->options().needs_robot_state ? robot_.WhyNotAlone(now_us) : robot_.WhyTwo(now_us);
  if (!why.empty()) watch_.Set(Watch::Need::kRobotState, fmt::format("waits for {}: {}", channels_.robot_state, why));
}

// Where no robot is needed, what was wrong with one that was heard does not count for longer than it is heard.
void CertifierNode::ForgetSilentRobot(std::int64_t now_us) {
  if (gate_->options().needs_robot_state) return;
  if (robot_.WhyTwo(now_us).empty()) watch_.Set(Watch::Need::kRobotState, "");
  const std::int64_t timeout = Microseconds(gate_->options().robot_timeout_ms);
  if (!robot_arrival_ || FreshnessOf(robot_arrival_->at_us, now_us, timeout, INT64_MAX) != Freshness::kStale) return;
  robot_arrival_.reset();
  LookAtStamps();
}

void CertifierNode::OnTransition(const Received& received) {
  LookAtCharge();
  if (!has_begun_) return;
  transitions_.Hear(received.sender, received.utime);
  const std::string two = transitions_.WhyTwo(received.utime);
  const auto transition = Decoded<transition_t>(received.bytes);
  if (transition) last_transition_ = *transition;
  if (!two.empty())
    Refuse(channels_.transition, two);
  else if (gate_->options().learns)
    Learn(received.bytes);  // first, because a false declaration explains a left slice
  if (!transition || !is_in_charge()) return;
  if (const auto departure = plans_.FindDeparture(*transition, received.sender)) Fail(SliceLeft(*departure));
}

void CertifierNode::Learn(Bytes transition) {
  const bool was_falsified = gate_->certifier().violation().has_value();
  const std::string error = gate_->Learn(transition);
  if (!error.empty()) return Refuse(channels_.transition, error);
  const auto& violation = gate_->certifier().violation();
  if (was_falsified || !violation) return;
  if (!contradictions_.ContradictInForce())
    contradictions_.Add({gate_->grounds().model, gate_->certifier().Contradiction()});
  Fail(DeclarationFalsified(*violation, gate_->certifier().problem().declaration.affine));
  latch_.Store();  // also where another fault stays
}

// The robot answers a withdrawal, or has stopped. Its other events are for people and records.
void CertifierNode::OnEvent(const Received& received) {
  LookAtCharge();
  events_.Hear(received.sender, received.utime);
  const auto event = Decoded<execution_event_t>(received.bytes);
  if (!event) return Refuse(channels_.event, "not an execution_event_t");
  plans_.SeeStop(*event, received.sender);
  if (event->kind != execution_event_t::WITHDRAWN) return;
  // Events are rare, so of two robots one alone may be heard here.
  for (const SoleSender* stream : {&events_, &robot_})
    if (const std::string two = stream->WhyTwo(received.utime); !two.empty()) return Refuse(channels_.event, two);
  // A certifier before this one has counted its withdrawals from 0, too.
  if (const std::string error = gate_->CheckFresh(event->utime, received.utime); !error.empty())
    return Refuse(channels_.event, error);
  if (is_in_charge()) plans_.TakeAnswer(*event);
}

void CertifierNode::OnCommand(const Received& received) {
  LookAtCharge();
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
        return Refuse(channels_.command, "the reset was sent before the fault, so nobody has inspected the fault");
      if (!latch_.Forget())
        return Refuse(channels_.command,
                      fmt::format("the fault stays, since the reset cannot be stored: {}", latch_.why_not()));
      if (watch_.Reset()) {
        ForgetRobot();
        logging::Warn("{} has cleared the fault", GetText(command.source));
      }
      reporter_.Hurry();
      return;
    case command_t::RELOAD: return Reload();
    default: return Refuse(channels_.command, fmt::format("unknown kind {}", command.kind));
  }
}

// ---- Faults.

void CertifierNode::Fail(const FoundFault& found) {
  const Watch::Fault latched{found.fault.cause, clocks_.wall(), found.why};
  if (watch_.Latch(latched)) Announce(found.fault, latched);
}

void CertifierNode::Announce(fault_t fault, const Watch::Fault& latched) {
  fault.utime = latched.utime;
  fault.sequence = reporter_.counts.faults++;
  fault.state = last_state_;
  fault.transition = last_transition_;
  SetText(fault.message, latched.why);
  // In the kernel's hands before anything is sent: a process that is killed now still finds the fault when it starts.
  latch_.Put(fault);
  SendFault();
  latch_.Flush();  // the disk may take longer than a robot can wait
  logging::Error("fault {}: {}; nothing is certified. What to do: {}", FaultName(latched.cause), latched.why,
                 FaultAdvice(latched.cause));
  reporter_.Hurry();
}

// A shadow stops no robot, unless that may execute what was certified before the task made it a shadow.
void CertifierNode::SendFault() {
  if (!is_in_charge() || (gate_->options().shadow && plans_.num_in_force() == 0)) return;
  latch_.Sent(clocks_.steady());
  sender_.Send(channels_.fault, latch_.fault());
}

// ---- Candidates.

void CertifierNode::Tick(std::int64_t now_us) {
  const bool was_idle = queue_.empty() && !withdraws_more_;
  LookAtCharge();
  LookForObstacles(now_us);
  ForgetSilentRobot(now_us);
  if (reporter_.IsFirst() && is_in_charge()) Heartbeat(now_us);  // reports the state before the first decision
  if (const auto fault = watch_.Advance(now_us, clocks_.steady())) {
    // After the clock was set back, a plan may start later than allowed.
    if (fault->cause == fault_t::CLOCK_JUMP) plans_.TolerateIssuedUntil(clocks_.steady());
    Announce(PlainFault(fault->cause, fault->why).fault, *fault);
  }
  TakeReload();
  // Before new certificates: what a robot may be driving is more urgent than what it may drive next.
  WithdrawPlans(now_us);
  AnswerWaiting();
  CompactIfDue();
  if (reporter_.IsDue(clocks_.steady())) Heartbeat(now_us);
  if (was_idle) GiveAdvice();
  if (was_idle) KeepWarm();
}

// Only where there is nothing else to do, and for a twentieth of the time. What arrives meanwhile waits until it is
// over: at most kWarmUs, but for once after each certificate.
void CertifierNode::KeepWarm() {
  const std::int64_t begin = clocks_.steady();
  if (!config_.realtime.keep_warm || !warms_ || !is_in_charge() || busy() || bus_.has_waiting() ||
      begin < next_warm_us_)
    return;
  gate_->KeepWarm();
  const std::int64_t end = clocks_.steady(), took = end - begin;
  warms_ = took <= kWarmUs;
  next_warm_us_ = end + std::max(kWarmUs, 20 * took);
}

void CertifierNode::WithdrawPlans(std::int64_t now_us) {
  withdraws_more_ = false;
  if (!is_in_charge()) return;
  plans_.SeeObstacles(gate_->WhyObstaclesUnknown(now_us), clocks_.steady());
  plans_.Judge(*gate_, now_us, gate_->certifier().violation() || contradictions_.ContradictInForce());
  reporter_.counts.withdrawals = plans_.withdrawals();
  for (int i = 0; i < kAtOnce && plans_.withdraws(); ++i) {
    const auto due = plans_.TakeDue(clocks_.wall(), clocks_.steady());
    if (!due) return;
    sender_.Send(channels_.withdrawn, due->message);
    if (due->is_repetition || due->message.cause == withdrawal_t::NOT_JUDGED) continue;
    logging::Warn("plan {} is withdrawn, cause {}, {} of its controls stand: {}", due->message.plan_id,
                  WithdrawalName(due->message.cause), due->message.valid_steps, GetText(due->message.message));
  }
  withdraws_more_ = plans_.withdraws();
}

void CertifierNode::AnswerWaiting() {
  if (!is_in_charge()) return;
  for (int i = 0; i < kAtOnce && !queue_.empty(); ++i) {
    const CandidateQueue::Candidate newest = queue_.TakeNewest();
    Answer(newest, false);
    AnswerDue();
    if (IsBatch(newest)) break;  // it may take as long as many
  }
  const auto most = static_cast<std::size_t>(gate_->options().queue);
  for (int i = 1; queue_.size() > most; ++i) {
    Answer(queue_.TakeOldest(), true);
    if (i % kAtOnce == 0) AnswerDue();  // answering a flood takes longer than the waiting candidates have
  }
}

// Answers the candidates that would be too late after another decision, while their start has not passed.
void CertifierNode::AnswerDue() {
  const std::int64_t earliest = gate_->EarliestStart(clocks_.wall());
  for (const CandidateQueue::Candidate& due : queue_.TakeStartingBefore(earliest)) Answer(due, false);
}

GateAnswer CertifierNode::Decide(Bytes candidate) {
  const std::int64_t now = clocks_.wall();
  LookForObstacles(now);
  if (const auto refusal = watch_.WhyNot())
    return gate_->Refuse(candidate, now, refusal->cause, refusal->why, refusal->outcome);
  // The gate does not know what was seen before a restart or by another certifier.
  if (contradictions_.ContradictInForce() && !gate_->certifier().violation())
    return gate_->Refuse(candidate, now, decision_t::CAUSE_PAIRWISE,
                         "a transition that was seen before contradicts the declaration; another has to be declared",
                         decision_t::ABSTAIN_FALSIFIED);
  // What could not be withdrawn is not certified.
  if (plans_.IsFull())
    return gate_->Refuse(candidate, now, decision_t::CAUSE_QUEUE_FULL,
                         "so many certified plans may be executed that another could not be withdrawn");
  const std::int64_t before = PageFaults();
  GateAnswer answer = gate_->Decide(candidate, clocks_.wall);
  reporter_.CountPageFaults(PageFaults() - before);
  return answer;
}

void CertifierNode::Answer(Bytes candidate, bool displaced) {
  const auto begin = std::chrono::steady_clock::now();
  GateAnswer answer = displaced ? gate_->Refuse(candidate, clocks_.wall(), decision_t::CAUSE_QUEUE_FULL,
                                                "newer candidates displaced it from the queue")
                                : Decide(candidate);
  const std::chrono::duration<double, std::micro> elapsed = std::chrono::steady_clock::now() - begin;
  answer.decision.elapsed_us = elapsed.count();

  // First the plan, for which a robot may wait; the ledger's copy is made after it was sent.
  if (answer.certified) sender_.Send(channels_.certified, *answer.certified);
  sender_.Send(channels_.decision, answer.decision);
  if (answer.certified) {
    warms_ = true;
    const NominalModel& model = *config_.problem->model;
    plans_.Add(*answer.certified, clocks_.steady(), AnglesOf(model.angles(), model.num_states()));
  }
  reporter_.CountDecision(elapsed.count());
  advice_.Note(candidate, answer.decision, gate_->options());
}

// Only in a tick that began with nothing to do: a decision is followed by a look at the bus, not by this.
void CertifierNode::GiveAdvice() {
  if (!is_in_charge() || !advice_.has_work() || withdraws_more_) return;
  auto advice = advice_.Give(*gate_, [this] { return bus_.has_waiting(); });
  if (!advice) return;
  advice->utime = clocks_.wall();
  sender_.Send(channels_.advice, *advice);
}

// ---- Background work.

void CertifierNode::CompactIfDue() {
  if (gate_->certifier().num_unindexed() < kUnindexedAtMost) return;
  if (gate_->certifier().num_observations() <= kIndexedAtOnce) return gate_->Compact();
  if (compaction_.valid() && !IsReady(compaction_)) return;
  compaction_ = RunInThread([gate = gate_.get()] { gate->Compact(); });
}

void CertifierNode::Reload() {
  if (!reload_.Ask()) reporter_.Hurry();
}

void CertifierNode::TakeReload() {
  if (compaction_.valid() && !IsReady(compaction_)) return;  // it works on *gate_
  std::optional<TaskReload::Loaded> loaded = reload_.Take(config_, contradictions_);
  if (!loaded) return;
  reporter_.Hurry();
  if (!loaded->error.empty()) return;
  // The old gate's counts, sources and obstacles stay; its observations do not.
  loaded->gate->Inherit(*gate_);
  gate_ = std::move(loaded->gate);
  config_ = std::move(loaded->config);
  charge_.Follow(config_.gate.shadow);
  if (config_.gate.shadow) logging::Warn(kShadowWarning);
  watch_.Follow(OptionsOf(config_));
  for (SoleSender* stream : {&robot_, &transitions_, &events_})
    stream->Follow(Microseconds(gate_->options().robot_timeout_ms));
  LookAtRobot(clocks_.wall());
  plans_.Follow(gate_->options());
  contradictions_.Follow(config_);
  LookForObstacles(clocks_.wall());
}

void CertifierNode::Heartbeat(std::int64_t now_us) {
  latch_.Check();
  const certifier_status_t status = reporter_.Report(*gate_, now_us, clocks_.steady());
  // The fault is sent first, for a robot that has just started.
  if (latch_.IsDue(clocks_.steady())) SendFault();
  sender_.Send(channels_.status, status);
}

void CertifierNode::Stop() {
  if (!is_in_charge()) LeaveWaiting();
  while (!queue_.empty()) AnswerWaiting();
  std::cout << reporter_.Summary(*gate_) << std::endl;
}

}  // namespace forereach
