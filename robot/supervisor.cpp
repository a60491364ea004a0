#include "robot/supervisor.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <exception>
#include <new>
#include <stdexcept>
#include <utility>

#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "lcmtypes/freshness.h"
#include "lcmtypes/names.h"
#include "robot/brake.h"

namespace forereach {
namespace {

constexpr std::size_t kMostStates = sizeof(robot_state_t::state) / sizeof(double);

// What a message has room for. A state of another size than the task's does not get past the guard.
template <std::size_t N>
std::int16_t SetValues(double (&field)[N], std::span<const double> values) {
  const std::size_t count = std::min(values.size(), N);
  std::copy_n(values.begin(), count, field);
  return static_cast<std::int16_t>(count);
}

// A sentence for an event, cut to what it has room for. Allocates nothing.
class EventText final {
 public:
  EventText& operator<<(std::string_view text) {
    size_ += text.copy(text_.data() + size_, text_.size() - size_);
    return *this;
  }
  EventText& operator<<(int number) {
    std::array<char, 16> digits;
    return *this << std::string_view(digits.data(),
                                     std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
  }
  operator std::string_view() const { return {text_.data(), size_}; }

 private:
  std::array<char, sizeof(execution_event_t::message)> text_;
  std::size_t size_ = 0;
};

// Describes the exception that is being handled.
EventText TextOfException() noexcept {
  EventText text;
  text << "emergency stop, not certified: the robot's program threw ";
  try {
    throw;
  } catch (const std::bad_alloc&) {
    text << "std::bad_alloc, it is out of memory";
  } catch (const std::exception& error) {
    text << "an exception: " << error.what();
  } catch (...) {
    text << "what is no std::exception";
  }
  return text;
}

constexpr Speaker kFaults{Role::kCertifier, kStopsAheadUs}, kCommands{Role::kOperator};

enum : std::size_t { kRobotState, kTransition, kEvent };  // indices of channels

}  // namespace

Supervisor::Supervisor(SupervisorOptions options, Robot& robot)
    : options_(std::move(options)),
      robot_(robot),
      guard_(options_.guard),
      reports_({options_.robot_state, options_.transition, options_.event}) {
  // So that no call allocates for a state of the size that the task has.
  state_.reserve(kMostStates);
  state_error_.reserve(kMostStates);
  step_began_at_.reserve(kMostStates);
  step_began_within_.reserve(kMostStates);
  if (!options_.guard.keys) return;
  authenticator_.emplace(*options_.guard.keys, options_.guard.bus_name,
                         Speakers{{options_.fault, kFaults}, {options_.command, kCommands}}, std::nullopt);
}

// Checks the signature and takes it off.
GuardVerdict Supervisor::Authenticated(const std::string& channel, const Speaker& speaker, Bytes& message,
                                       std::int64_t now_us) {
  if (!authenticator_) return {};
  const auto [authenticity, content] = authenticator_->Check(channel, message, now_us);
  message = content;
  return VerdictOn(authenticity, channel, speaker);
}

// Whether a function of the robot calls what it may not: that does nothing, and the call under way ends with a hold.
bool Supervisor::IsMisuse(bool may_be_sending) noexcept {
  // A robot's Send that calls back would change the plan in the middle of a decision about it.
  const bool is_misuse = is_deciding_ || (is_sending_ && !may_be_sending);
  is_misused_ = is_misused_ || is_misuse;
  return is_misuse;
}

// Does the work of a call. The reports that it adds are sent after it.
template <class Work>
void Supervisor::Run(std::int64_t utime, const Work& work) noexcept {
  is_deciding_ = true;
  try {
    work();
    // Whatever the work did, no call ends with a robot that moves without a plan.
    if (!IsExecuting()) HoldIfMoving();  // after a fault, or if Hold threw before
    if (is_misused_) throw std::logic_error("a function of Supervisor::Robot called the supervisor");
  } catch (...) {
    StopAfterException(utime);
  }
  is_deciding_ = is_misused_ = false;
}

// Called where the exception is caught.
void Supervisor::StopAfterException(std::int64_t utime) noexcept {
  ++counts_.errors;
  ReportEvent(utime, execution_event_t::ERROR_STOP, PlanId(), Step(), 0, TextOfException());
  try {
    HoldIfMoving();
  } catch (...) {  // the next call tries it again
  }
}

void Supervisor::Measure() {
  // Set again at the end: if the robot throws in between, no state is reported that nobody measured.
  is_measured_ = false;
  const std::span<const double> state = robot_.state();
  state_.assign(state.begin(), state.end());
  const std::span<const double> error = robot_.state_error();
  state_error_.assign(error.begin(), error.end());
  is_measured_ = true;
}

void Supervisor::OnCertified(Bytes message, std::int64_t now_us) noexcept {
  if (IsMisuse(true)) return;
  Run(now_us, [&] {
    const GuardVerdict verdict = guard_.Accept(message, now_us);
    Measure();
    if (!verdict.ok()) return ReportRefusal(now_us, verdict);
    ++counts_.accepted;
    ReportEvent(now_us, execution_event_t::ACCEPTED, verdict.plan_id, -1, 0, "the plan waits for its start");
  });
  SendReports(now_us);
}

void Supervisor::OnWithdrawn(Bytes message, std::int64_t now_us) noexcept {
  if (IsMisuse(true)) return;
  Run(now_us, [&] {
    const GuardWithdrawal answer = guard_.Withdraw(message, now_us);
    Measure();
    if (answer.verdict.ok())
      ReportEvent(now_us, execution_event_t::WITHDRAWN, answer.verdict.plan_id, answer.standing_steps,
                  static_cast<double>(answer.sequence), answer.message);
    else
      ReportRefusal(now_us, answer.verdict);
    // Not at the next boundary: until then another control of what was withdrawn might be applied.
    if (IsExecuting() && MustStop()) StopInEmergency(now_us);
  });
  SendReports(now_us);
}

void Supervisor::OnFault(Bytes message, std::int64_t now_us) noexcept {
  if (IsMisuse(true)) return;
  Run(now_us, [&] { TakeFault(message, now_us); });
  SendReports(now_us);
}

void Supervisor::TakeFault(Bytes message, std::int64_t now_us) {
  const GuardVerdict verdict = Authenticated(options_.fault, kFaults, message, now_us);
  if (!verdict.ok()) {
    Measure();
    return ReportRefusal(now_us, verdict);
  }
  const auto fault = Decoded<fault_t>(message);
  if (!fault || !StopsTheRobot(fault->cause)) return;
  // The certifier repeats a fault until it hears the reset, which the robot may have heard before.
  if (IsNotAfter(fault->utime, reset_utime_, now_us, options_.max_ahead_us)) return;
  halted_utime_ = guard_.halted() ? std::max(halted_utime_, fault->utime) : fault->utime;
  if (guard_.halted()) return;
  const std::int64_t plan_id = PlanId();
  const int step = Step();
  // First of all: what follows may throw.
  guard_.Halt();
  const auto report = [&] {
    ReportEvent(now_us, execution_event_t::HALTED, plan_id, step, 0,
                EventText() << "emergency stop: " << GetText(fault->message));
  };
  try {
    Measure();
  } catch (...) {  // a person has to know that it waits for a reset
    report();
    throw;
  }
  report();
}

std::string Supervisor::OnCommand(Bytes message, std::int64_t now_us) noexcept {
  std::string why = "not obeyed";  // short enough for a string without an allocation
  if (IsMisuse(true)) return why;
  Run(now_us, [&] { why = Obey(message, now_us); });
  SendReports(now_us);
  return why;
}

std::string Supervisor::Obey(Bytes message, std::int64_t now_us) {
  if (const GuardVerdict verdict = Authenticated(options_.command, kCommands, message, now_us); !verdict.ok()) {
    Measure();
    ReportRefusal(now_us, verdict);
    return verdict.message;
  }
  const auto command = Decoded<command_t>(message);
  if (!command) return "";
  if (std::string why = WhyNotFresh(command->utime, now_us, options_.max_age_us, options_.max_ahead_us); !why.empty())
    return why;
  if (command->kind == command_t::RELOAD) robot_.Reload();
  if (command->kind != command_t::RESET) return "";
  // A reset was meant for the fault that somebody looked at; a later fault needs another one.
  if (guard_.halted() && IsNotAfter(command->utime, halted_utime_, now_us, options_.max_ahead_us))
    return "a reset from before the robot was halted";
  reset_utime_ = std::min(command->utime, now_us);  // a clock that is ahead clears no fault to come
  if (!guard_.halted()) return "";
  guard_.Reset();
  Measure();
  ReportEvent(now_us, execution_event_t::RESET, -1, -1, 0, EventText() << GetText(command->source) << " lets it go on");
  return "";
}

std::span<const double> Supervisor::Boundary(std::int64_t utime, std::int64_t now_us, bool ends) noexcept {
  if (IsMisuse(false)) return {};
  Run(utime, [&] {
    Measure();
    CheckStep(utime, now_us);
    if (!ends) StartPending(utime, now_us);
    if (IsExecuting()) ContinuePlan(utime);
    step_began_at_ = state_;
    step_began_us_ = now_us;
    step_began_within_ = state_error_;
    is_under_way_ = IsExecuting();
  });
  ReportState(utime, ends);
  ++counts_.boundaries;
  SendReports(utime);
  return control();
}

void Supervisor::FinishStep(std::int64_t utime, std::int64_t now_us) noexcept {
  if (IsMisuse(false)) return;
  Run(utime, [&] {
    Measure();
    CheckStep(utime, now_us);
  });
  SendReports(utime);
}

void Supervisor::CheckStep(std::int64_t utime, std::int64_t now_us) {
  if (!IsExecuting()) return HoldIfMoving();
  const std::int64_t plan_id = PlanId();
  const bool is_new = std::exchange(is_under_way_, false);
  if (is_new) {
    ++step_;
    // A transition whose time or errors are not within what is declared would teach the certifier something false.
    if (guard_.IsOnSchedule(step_, now_us) && guard_.IsDeclared(step_began_within_) && guard_.IsDeclared(state_error_))
      ReportTransition(utime - options_.guard.step_us, now_us - step_began_us_);
  }
  const GuardVerdict verdict =
      is_new ? guard_.Check(step_, state_, now_us, state_error_) : guard_.CheckAgain(state_, now_us, state_error_);
  if (verdict.ok()) {
    if (!is_new) return;
    ++(verdict.is_inside() ? counts_.steps_inside : counts_.steps_consistent);
    if (verdict.is_inside())
      return ReportEvent(utime, execution_event_t::STEP_INSIDE, plan_id, step_, 0, "inside the certified slice");
    return ReportEvent(utime, execution_event_t::STEP_CONSISTENT, plan_id, step_, verdict.value,
                       "consistent with the certified slice, within the state error", verdict.coordinate);
  }
  halted_utime_ = now_us;
  const bool is_off = verdict.cause == GuardCause::kOffSchedule;
  ReportEvent(utime, is_off ? execution_event_t::OFF_SCHEDULE : execution_event_t::STEP_OUTSIDE, plan_id, step_,
              verdict.value, EventText() << "emergency stop: " << verdict.message, verdict.coordinate);
  Hold();
}

void Supervisor::StartPending(std::int64_t utime, std::int64_t now_us) {
  if (guard_.pending() == nullptr) return;
  const GuardVerdict verdict = guard_.TryStart(utime, now_us, state_, state_error_);
  if (verdict.cause == GuardCause::kTooEarly) return;
  if (!verdict.ok()) return ReportRefusal(utime, verdict);
  step_ = 0;
  is_holding_ = false;
  ++counts_.started;
  ReportEvent(utime, execution_event_t::STARTED, verdict.plan_id, 0, 0,
              EventText() << guard_.executing()->plan.num_steps << " steps");
}

void Supervisor::ContinuePlan(std::int64_t utime) {
  step_utime_ = utime;
  // Before the step begins, while a stop still fits into what stands.
  if (MustStop()) return StopInEmergency(utime);
  const candidate_plan_t& plan = guard_.executing()->plan;
  if (step_ == plan.num_steps) {
    ReportEvent(utime, execution_event_t::STANDING, plan.plan_id, step_, 0, "the plan is finished: holding still");
    Hold();
  } else if (step_ == plan.progress_steps) {
    ReportEvent(utime, execution_event_t::TAIL_BEGUN, plan.plan_id, step_, 0, "no newer certificate: braking");
  }
}

// Whether the robot has to leave what stands now. It may go on if a stop that begins at the next boundary ends within
// what stands, from every state of that boundary's slice.
bool Supervisor::MustStop() const {
  const std::optional<int> standing = guard_.standing_steps();
  if (!standing) return false;
  const certified_plan_t& plan = *guard_.executing();
  const int next = step_ + 1, left = *standing - next;
  const auto states = static_cast<std::size_t>(plan.plan.num_states);
  if (left >= 0 && robot_.StepsToRest({plan.slice_lower[next], states}, {plan.slice_upper[next], states}) <= left)
    return false;
  return left < 0 || !TakesOver(*standing);
}

// Whether the pending plan starts within what stands, at a boundary that the guard takes for its start.
bool Supervisor::TakesOver(int standing) const {
  const certified_plan_t* const next = guard_.pending();
  // One whose start has passed will be refused, so it is no way out.
  if (!next || next->plan.start_utime < step_utime_) return false;
  const std::uint64_t ahead =
      static_cast<std::uint64_t>(next->plan.start_utime) - static_cast<std::uint64_t>(step_utime_);
  const auto step_us = static_cast<std::uint64_t>(options_.guard.step_us);
  const std::uint64_t after = ahead % step_us, off = std::min(after, step_us - after);  // from the nearest boundary
  const std::uint64_t boundary = ahead / step_us + (after > step_us - after ? 1 : 0);
  return off <= static_cast<std::uint64_t>(StartTolerance(*next)) &&
         boundary <= static_cast<std::uint64_t>(std::max(standing - step_, 0));
}

void Supervisor::StopInEmergency(std::int64_t utime) {
  const int standing = *guard_.standing_steps();
  const bool can_be_asked = std::ssize(state_) == options_.guard.num_states;
  const int needed = can_be_asked ? robot_.StepsToRest(state_, state_) : Brake::kNoEnd;
  ++counts_.emergency_stops;
  EventText text;
  text << "emergency stop, not certified: controls from " << standing
       << " on were withdrawn, no newer certificate takes over; " << std::max(standing - step_, 0)
       << " stand, the stop takes ";
  if (needed == Brake::kNoEnd)
    text << "an unknown number of";
  else
    text << needed;
  ReportEvent(utime, execution_event_t::EMERGENCY_STOP, PlanId(), step_, needed == Brake::kNoEnd ? -1 : needed,
              text << " steps");
  Hold();
}

int Supervisor::Robot::StepsToRest(std::span<const double> /*lower*/, std::span<const double> /*upper*/) const {
  return Brake::kNoEnd;
}

void Supervisor::Hold() {
  // Before the brakes: should they throw, no control of the plan is handed out any more.
  guard_.Finish();
  is_under_way_ = false;
  robot_.Hold();
  is_holding_ = true;
  Measure();  // the brakes may act at once
}

void Supervisor::HoldIfMoving() {
  if (!is_holding_) Hold();
}

void Supervisor::Expect(const Digest& config_digest, const Digest& model_digest, std::optional<GuardDomain> domain,
                        const std::optional<std::vector<int>>& angles) {
  guard_.Expect(config_digest, model_digest, std::move(domain), angles);
}

void Supervisor::Report(std::int64_t utime, std::int16_t kind, double value, std::string_view text) noexcept {
  if (is_deciding_) return ReportEvent(utime, kind, PlanId(), Step(), value, text);
  Run(utime, [&] {
    Measure();
    ReportEvent(utime, kind, PlanId(), Step(), value, text);
  });
  SendReports(utime);
}

std::int64_t Supervisor::PlanId() const { return IsExecuting() ? guard_.executing()->plan.plan_id : -1; }

void Supervisor::ReportState(std::int64_t utime, bool ends) noexcept {
  if (!is_measured_) return;
  robot_state_t message{};
  message.utime = utime;
  message.sequence = counts_.boundaries;
  message.executing_plan_id = PlanId();
  message.executing_step = static_cast<std::int16_t>(Step());
  message.mode = IsExecuting() ? robot_state_t::EXECUTING : ends ? robot_state_t::FINISHED : robot_state_t::STANDING;
  message.num_states = SetValues(message.state, state_);
  message.num_state_errors = SetValues(message.state_error, state_error_);
  reports_.Add(kRobotState, message);
}

void Supervisor::ReportTransition(std::int64_t utime, std::int64_t duration_us) noexcept {
  transition_t message{};
  message.utime = utime;
  message.sequence = counts_.steps++;
  message.duration_us = duration_us;
  message.num_states = SetValues(message.state, step_began_at_);
  message.num_inputs = SetValues(message.input, guard_.control());
  SetValues(message.next_state, state_);
  reports_.Add(kTransition, message);
}

void Supervisor::ReportRefusal(std::int64_t utime, const GuardVerdict& verdict) {
  const std::string_view cause = GuardCauseName(verdict.cause);
  ReportEvent(utime, execution_event_t::REFUSED, verdict.plan_id, verdict.step, verdict.value,
              EventText() << cause << ": " << verdict.message, verdict.coordinate);
  ++counts_.refused[std::string(cause)];
}

void Supervisor::ReportEvent(std::int64_t utime, std::int16_t kind, std::int64_t plan_id, int step, double value,
                             std::string_view text, int coordinate) noexcept {
  execution_event_t message{};
  message.utime = utime;
  message.sequence = events_++;
  message.plan_id = plan_id;
  message.kind = kind;
  message.step = static_cast<std::int16_t>(step);
  message.coordinate = static_cast<std::int16_t>(coordinate);
  message.num_states = SetValues(message.state, state_);
  message.value = value;
  SetText(message.message, text);
  reports_.Add(kEvent, message);
}

void Supervisor::SendReports(std::int64_t utime) noexcept {
  // A Send that leads to another report adds it; the loop under way sends it.
  if (std::exchange(is_sending_, true)) return;
  reports_.Send([this](const std::string& channel, Bytes message) { robot_.Send(channel, message); });
  is_sending_ = false;
  if (is_misused_) Run(utime, [] {});
  counts_.failed_sends = reports_.failures();
  counts_.reports_lost = reports_.lost();
}

}  // namespace forereach
