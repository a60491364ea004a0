#include "robot/supervisor.h"

#include <algorithm>
#include <utility>

#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "lcmtypes/freshness.h"
#include "lcmtypes/names.h"
#include "robot/brake.h"

namespace forereach {
namespace {

// What a message has room for. A state of another size than the task's does not get past the guard.
template <std::size_t N>
std::int16_t SetValues(double (&field)[N], std::span<const double> values) {
  const std::size_t count = std::min(values.size(), N);
  std::copy_n(values.begin(), count, field);
  return static_cast<std::int16_t>(count);
}

}  // namespace

Supervisor::Supervisor(SupervisorOptions options, Robot& robot)
    : options_(std::move(options)), robot_(robot), guard_(options_.guard) {
  if (!options_.guard.keys) return;
  authenticator_.emplace(*options_.guard.keys, options_.guard.bus_name,
                         Speakers{{options_.fault, Role::kCertifier}, {options_.command, Role::kOperator}},
                         std::nullopt);
}

// Takes off the trailer.
GuardVerdict Supervisor::Authenticated(const std::string& channel, std::string_view speaker, Bytes& message,
                                       std::int64_t now_us) {
  if (!authenticator_) return {};
  const auto [authenticity, content] = authenticator_->Check(channel, message, now_us);
  message = content;
  return VerdictOn(authenticity, channel, speaker);
}

void Supervisor::OnCertified(Bytes message, std::int64_t now_us) {
  const GuardVerdict verdict = guard_.Accept(message, now_us);
  if (!verdict.ok()) return SendRefusal(now_us, verdict);
  ++counts_.accepted;
  SendEvent(now_us, execution_event_t::ACCEPTED, verdict.plan_id, -1, 0, "the plan waits for its start");
}

void Supervisor::OnWithdrawn(Bytes message, std::int64_t now_us) {
  const GuardWithdrawal answer = guard_.Withdraw(message, now_us);
  if (!answer.verdict.ok()) return SendRefusal(now_us, answer.verdict);
  SendEvent(now_us, execution_event_t::WITHDRAWN, answer.verdict.plan_id, answer.standing_steps,
            static_cast<double>(answer.sequence), answer.message);
  if (IsExecuting() && MustStop()) StopInEmergency(now_us);
}

void Supervisor::OnFault(Bytes message, std::int64_t now_us) {
  const GuardVerdict verdict = Authenticated(options_.fault, "certifier", message, now_us);
  if (!verdict.ok()) return SendRefusal(now_us, verdict);
  const auto fault = Decoded<fault_t>(message);
  if (!fault || !StopsTheRobot(fault->cause)) return;
  // The certifier repeats a fault until it hears the reset, which the robot may have heard before.
  if (IsNotAfter(fault->utime, reset_utime_, now_us, options_.max_ahead_us)) return;
  halted_utime_ = fault->utime;
  if (guard_.halted()) return;
  const std::int64_t plan_id = PlanId();
  const int step = Step();
  if (IsExecuting()) Hold();
  guard_.Halt();
  SendEvent(now_us, execution_event_t::HALTED, plan_id, step, 0, "emergency stop: " + GetText(fault->message));
}

std::string Supervisor::OnCommand(Bytes message, std::int64_t now_us) {
  if (const GuardVerdict verdict = Authenticated(options_.command, "operator", message, now_us); !verdict.ok()) {
    ++counts_.refused[std::string(GuardCauseName(verdict.cause))];
    return verdict.message;
  }
  const auto command = Decoded<command_t>(message);
  if (!command) return "";
  if (std::string why = WhyNotFresh(command->utime, now_us, options_.max_age_us, options_.max_ahead_us); !why.empty())
    return why;
  if (command->kind == command_t::RELOAD) robot_.Reload();
  if (command->kind != command_t::RESET) return "";
  if (guard_.halted() && IsNotAfter(command->utime, halted_utime_, now_us, options_.max_ahead_us))
    return "a reset from before the robot was halted";
  reset_utime_ = std::min(command->utime, now_us);  // a clock that is ahead clears no fault to come
  if (!guard_.halted()) return "";
  guard_.Reset();
  SendEvent(now_us, execution_event_t::RESET, -1, -1, 0, GetText(command->source) + " lets it go on");
  return "";
}

std::span<const double> Supervisor::Boundary(std::int64_t utime, std::int64_t now_us, bool ends) {
  FinishStep(utime, now_us);
  if (!ends) StartPending(utime, now_us);
  if (IsExecuting()) ContinuePlan(utime);
  SendState(utime, ends);
  ++counts_.boundaries;
  is_under_way_ = IsExecuting();
  step_began_at_.assign(robot_.state().begin(), robot_.state().end());
  return control();
}

void Supervisor::FinishStep(std::int64_t utime, std::int64_t now_us) {
  if (!std::exchange(is_under_way_, false) || !IsExecuting()) return;
  const std::int64_t plan_id = PlanId();
  SendTransition(utime - options_.guard.step_us);
  ++step_;
  const GuardVerdict verdict = guard_.Check(step_, robot_.state(), now_us);
  if (verdict.ok()) {
    ++counts_.steps_inside;
    return SendEvent(utime, execution_event_t::STEP_INSIDE, plan_id, step_, 0, "inside the certified slice");
  }
  const bool is_off = verdict.cause == GuardCause::kOffSchedule;
  SendEvent(utime, is_off ? execution_event_t::OFF_SCHEDULE : execution_event_t::STEP_OUTSIDE, plan_id, step_,
            verdict.value, "emergency stop: " + verdict.message, verdict.coordinate);
  halted_utime_ = now_us;
  Hold();
}

void Supervisor::StartPending(std::int64_t utime, std::int64_t now_us) {
  if (guard_.pending() == nullptr) return;
  const GuardVerdict verdict = guard_.TryStart(utime, now_us, robot_.state());
  if (verdict.cause == GuardCause::kTooEarly) return;
  if (!verdict.ok()) return SendRefusal(utime, verdict);
  step_ = 0;
  ++counts_.started;
  SendEvent(utime, execution_event_t::STARTED, verdict.plan_id, 0, 0,
            std::to_string(guard_.executing()->plan.num_steps) + " steps");
}

void Supervisor::ContinuePlan(std::int64_t utime) {
  step_utime_ = utime;
  if (MustStop()) return StopInEmergency(utime);
  const candidate_plan_t& plan = guard_.executing()->plan;
  if (step_ == plan.num_steps) {
    SendEvent(utime, execution_event_t::STANDING, plan.plan_id, step_, 0, "the plan is finished: holding still");
    Hold();
  } else if (step_ == plan.progress_steps) {
    SendEvent(utime, execution_event_t::TAIL_BEGUN, plan.plan_id, step_, 0, "no newer certificate: braking");
  }
}

// Whether the robot has to leave what stands now. It may go on if a stop that begins at the next boundary ends within
// what stands, from every state of that boundary's slice.
bool Supervisor::MustStop() const {
  const std::optional<int> standing = guard_.standing_steps();
  if (!standing) return false;
  const certified_plan_v2_t& plan = *guard_.executing();
  const int next = step_ + 1, left = *standing - next;
  const auto states = static_cast<std::size_t>(plan.plan.num_states);
  if (left >= 0 && robot_.StepsToRest({plan.slice_lower[next], states}, {plan.slice_upper[next], states}) <= left)
    return false;
  return left < 0 || !TakesOver(*standing);
}

// Whether the pending plan starts within what stands, at a boundary that the guard takes for its start.
bool Supervisor::TakesOver(int standing) const {
  const certified_plan_v2_t* const next = guard_.pending();
  if (!next || next->plan.start_utime < step_utime_) return false;
  const std::uint64_t ahead =
      static_cast<std::uint64_t>(next->plan.start_utime) - static_cast<std::uint64_t>(step_utime_);
  const auto step_us = static_cast<std::uint64_t>(options_.guard.step_us);
  const std::uint64_t after = ahead % step_us, off = std::min(after, step_us - after);  // from the nearest boundary
  const std::uint64_t boundary = ahead / step_us + (after > step_us - after ? 1 : 0);
  return off <= static_cast<std::uint64_t>(StartTolerance(options_.guard)) &&
         boundary <= static_cast<std::uint64_t>(std::max(standing - step_, 0));
}

void Supervisor::StopInEmergency(std::int64_t utime) {
  ++counts_.emergency_stops;
  const int standing = *guard_.standing_steps(), needed = robot_.StepsToRest(robot_.state(), robot_.state());
  const bool is_known = needed != Brake::kNoEnd;
  SendEvent(utime, execution_event_t::EMERGENCY_STOP, PlanId(), step_, is_known ? needed : -1,
            "emergency stop, not certified: controls from " + std::to_string(standing) +
                " on were withdrawn, no newer certificate takes over; " +
                std::to_string(std::max(standing - step_, 0)) + " stand, the stop takes " +
                (is_known ? std::to_string(needed) : "an unknown number of") + " steps");
  Hold();
}

int Supervisor::Robot::StepsToRest(std::span<const double> /*lower*/, std::span<const double> /*upper*/) const {
  return Brake::kNoEnd;
}

void Supervisor::Hold() {
  guard_.Finish();
  robot_.Hold();
}

void Supervisor::Expect(const Digest& config_digest, const Digest& model_digest, std::optional<GuardDomain> domain,
                        const std::optional<std::vector<int>>& angles) {
  guard_.Expect(config_digest, model_digest, std::move(domain), angles);
}

void Supervisor::Report(std::int64_t utime, std::int16_t kind, double value, std::string_view text) {
  SendEvent(utime, kind, PlanId(), Step(), value, text);
}

std::int64_t Supervisor::PlanId() const { return IsExecuting() ? guard_.executing()->plan.plan_id : -1; }

void Supervisor::SendState(std::int64_t utime, bool ends) {
  robot_state_t message{};
  message.utime = utime;
  message.sequence = counts_.boundaries;
  message.executing_plan_id = PlanId();
  message.executing_step = static_cast<std::int16_t>(Step());
  message.mode = IsExecuting() ? robot_state_t::EXECUTING : ends ? robot_state_t::FINISHED : robot_state_t::STANDING;
  message.num_states = SetValues(message.state, robot_.state());
  Send(options_.robot_state, message);
}

void Supervisor::SendTransition(std::int64_t utime) {
  transition_t message{};
  message.utime = utime;
  message.sequence = counts_.steps++;
  message.num_states = SetValues(message.state, step_began_at_);
  message.num_inputs = SetValues(message.input, control());
  SetValues(message.next_state, robot_.state());
  Send(options_.transition, message);
}

void Supervisor::SendRefusal(std::int64_t utime, const GuardVerdict& verdict) {
  const std::string cause(GuardCauseName(verdict.cause));
  ++counts_.refused[cause];
  SendEvent(utime, execution_event_t::REFUSED, verdict.plan_id, verdict.step, verdict.value,
            cause + ": " + verdict.message, verdict.coordinate);
}

void Supervisor::SendEvent(std::int64_t utime, std::int16_t kind, std::int64_t plan_id, int step, double value,
                           std::string_view text, int coordinate) {
  execution_event_t message{};
  message.utime = utime;
  message.sequence = events_++;
  message.plan_id = plan_id;
  message.kind = kind;
  message.step = static_cast<std::int16_t>(step);
  message.coordinate = static_cast<std::int16_t>(coordinate);
  message.num_states = SetValues(message.state, robot_.state());
  message.value = value;
  SetText(message.message, text);
  Send(options_.event, message);
}

}  // namespace forereach
