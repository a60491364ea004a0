#include "certifier/gate/plan_ledger.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/core.h>

#include "certifier/gate/stamp.h"
#include "forereach/certify/explain.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

// The bus contract fixes the numbers, so they are the same on both sides.
static_assert(static_cast<int>(Cause::kPairwise) == withdrawal_t::FALSIFIED &&
              static_cast<int>(Cause::kDomainExit) == withdrawal_t::DOMAIN_EXIT &&
              static_cast<int>(Cause::kNoFiniteEnclosure) == withdrawal_t::NO_FINITE_ENCLOSURE &&
              static_cast<int>(Cause::kObstacle) == withdrawal_t::OBSTACLE &&
              static_cast<int>(Cause::kNoStop) == withdrawal_t::NO_STOP &&
              static_cast<int>(Cause::kLimit) == withdrawal_t::LIMIT &&
              static_cast<int>(Cause::kBetween) == withdrawal_t::BETWEEN &&
              static_cast<int>(Cause::kBound) == withdrawal_t::BOUND);

withdrawal_t Unjudged(std::int16_t cause, const std::string& why) {
  withdrawal_t message{};
  message.cause = cause;
  message.step = message.obstacle = -1;
  SetText(message.message, why);
  return message;
}

// A plan stands that another process certified under these. What was learned takes nothing back, by whichever of the
// two, unless it contradicts the declaration. Then the observations are not those of the file alone: no plan stands.
Grounds GroundsForStranger(const Gate& gate, bool is_falsified) {
  Grounds grounds = gate.grounds();
  if (!is_falsified)
    grounds.observations = gate.transitions();
  else if (grounds.observations == gate.transitions())
    grounds.observations = {};
  return grounds;
}

withdrawal_t Judged(const Standing& standing, const Gate& gate) {
  const Decision& verdict = standing.verdict;
  if (verdict.outcome == Outcome::kNone) return Unjudged(withdrawal_t::NOT_JUDGED, "it cannot be judged again");
  withdrawal_t message{};
  message.valid_steps = static_cast<std::int16_t>(standing.steps);
  message.cause = static_cast<std::int16_t>(verdict.cause);
  message.step = static_cast<std::int16_t>(verdict.step);
  message.obstacle = static_cast<std::int16_t>(verdict.obstacle);
  message.margin = verdict.margin;
  message.threshold = verdict.threshold;
  SetText(message.message, fmt::format("the first {} controls stand; now {}", standing.steps,
                                       Explain(verdict, gate.certifier().problem(), gate.obstacles())));
  return message;
}

constexpr auto kIsInForce = [](const auto& record) { return record.force != nullptr; };

int StepIn(int num_steps, const robot_state_t& state) { return std::clamp<int>(state.executing_step, 0, num_steps); }

}  // namespace

PlanLedger::PlanLedger(const GateOptions& gate, std::int64_t steady_us) {
  Follow(gate);
  TolerateIssuedUntil(steady_us);
}

void PlanLedger::Follow(const GateOptions& gate) {
  lifetime_us_ = Microseconds(gate.certificate_lifetime_ms);
  delay_us_ = Microseconds(gate.max_age_ms);
  step_us_ = Microseconds(gate.longest_step_ms);
  const double lost_ms = gate.obstacles_lost_ms.value_or(kNeverLost);
  lost_us_ = lost_ms == kNeverLost ? std::nullopt : std::optional(Microseconds(lost_ms));
  silence_us_ = gate.needs_robot_state ? std::optional(Microseconds(gate.robot_timeout_ms)) : std::nullopt;
}

void PlanLedger::Add(const certified_plan_t& certified, std::int64_t steady_us, const Angles& angles) {
  ForgetEnded(steady_us);
  const auto whole = std::make_shared<const certified_plan_t>(certified);
  KeepSlices({whole, angles});
  const candidate_plan_t& plan = whole->plan;
  Record& record = Append(plan.plan_id, plan.num_steps);
  record.is_known = true;
  record.expires_utime = certified.expires_utime;
  record.step_us = plan.step_us;
  record.ends_us = steady_us + LongestLife(plan.num_steps);
  InForce& force = *record.force;
  // A robot that has begun it reports this before its states count as lost.
  force.may_run_until_us = silence_us_ ? steady_us + lifetime_us_ + 2 * delay_us_ + *silence_us_ : record.ends_us;
  std::ranges::copy(plan.source, force.source.begin());
  force.plan_digest = GetDigest(certified.plan_digest);
  force.certificate_digest = GetDigest(certified.certificate_digest);
  force.judged = whole;
  force.standing_steps = plan.num_steps;
  DropOldestJudged();
}

// The messages with its first and its last state may each be delayed.
std::int64_t PlanLedger::LongestRun(int num_steps) const { return 2 * delay_us_ + num_steps * step_us_; }

// From the issue of a certificate to the end of its plan, which begins before the certificate expires.
std::int64_t PlanLedger::LongestLife(int num_steps) const { return lifetime_us_ + LongestRun(num_steps); }

PlanLedger::Record& PlanLedger::Append(std::int64_t plan_id, int num_steps) {
  if (records_.size() >= kPlans) ForgetOldest();
  return records_.emplace_back(Record{plan_id, num_steps});
}

// Where no robot is heard, nothing else forgets them.
void PlanLedger::ForgetEnded(std::int64_t steady_us) {
  for (Record& record : records_) {
    if (!record.force) continue;
    if (record.force->may_run_until_us >= steady_us) break;
    record.force.reset();
  }
  while (!records_.empty() && HasEnded(records_.front(), steady_us)) records_.pop_front();
}

void PlanLedger::ForgetOldest() {
  const auto oldest = std::ranges::find_if_not(records_, kIsInForce);
  // What may be executed is never forgotten for want of room: the ledger is full, and says so (IsFull).
  if (oldest == records_.end()) return;
  // What is forgotten may still run, and nothing tells it from a plan that nobody certified.
  tolerates_until_us_ = std::max(tolerates_until_us_, oldest->ends_us);
  records_.erase(oldest);
}

bool PlanLedger::HasEnded(const Record& record, std::int64_t steady_us) {
  return !record.force && record.ends_us < steady_us;
}

void PlanLedger::StandBy() {
  measured_ = {};
  for (Record& record : records_) record.force.reset();
  unknown_since_us_.reset();
}

// ---- Departures.

void PlanLedger::KeepSlices(Slices added) {
  std::deque<Slices>& slices = measured_.slices;
  const std::int64_t executing = measured_.last.plan_id, plan_id = added.certified->plan.plan_id;
  if (const auto known = FindSlices(plan_id); known != slices.end()) {
    // A guard takes no second plan under the number that it executes.
    if (plan_id != executing) slices[ToSize(known - slices.begin())] = std::move(added);
    return;
  }
  if (slices.size() == kSlices) {
    // A flood of certificates must not end the test of the plan that the robot drives.
    if (executing >= 0 && slices.front().certified->plan.plan_id == executing)
      std::rotate(slices.begin(), slices.begin() + 1, slices.end());
    slices.pop_front();
  }
  slices.push_back(std::move(added));
}

std::deque<PlanLedger::Slices>::const_iterator PlanLedger::FindSlices(std::int64_t plan_id) const {
  return std::ranges::find(measured_.slices, plan_id,
                           [](const Slices& slices) { return slices.certified->plan.plan_id; });
}

std::optional<PlanLedger::Departure> PlanLedger::FindDeparture(const robot_state_t& state, SenderId sender) {
  StreamOrder& order = measured_.order;
  Place& last = measured_.last;
  const std::span<const double> measured(state.state, ToSize(state.num_states));
  const bool executing = state.mode == robot_state_t::EXECUTING;
  const StreamPosition position{state.sequence, state.utime};
  const Succession succession = order.Compare(position, StreamOrder::kNoHorizon);
  const bool follows = succession == Succession::kNewer && order.newest() &&
                       state.sequence - 1 == order.newest()->sequence && last.sender == sender;
  std::optional<Departure> departure;
  const std::span<const double> error(state.state_error, ToSize(state.num_state_errors));
  // Where another plan takes over, this is also the state at the end of the old plan's step.
  if (executing && follows && last.plan_id >= 0) departure = Compare(last.plan_id, last.step + 1, measured, error);
  if (executing && !departure) departure = Compare(state.executing_plan_id, state.executing_step, measured, error);
  // A late state does not tell where the robot is now.
  if (IsNews(succession) || succession == Succession::kRewound) {
    order.Take(position, StreamOrder::kNoHorizon);
    last = {state.utime, executing ? state.executing_plan_id : -1, state.executing_step, sender};
    measured_.places[measured_.next_place] = last;
    measured_.next_place = (measured_.next_place + 1) % kPlaces;
  }
  return departure;
}

void PlanLedger::SeeStop(const execution_event_t& event, SenderId sender) {
  Place& last = measured_.last;
  const bool is_stop = event.kind == execution_event_t::ERROR_STOP || event.kind == execution_event_t::EMERGENCY_STOP ||
                       event.kind == execution_event_t::OFF_SCHEDULE || event.kind == execution_event_t::HALTED;
  // It may have passed a boundary since its last state.
  const bool is_here = event.step == last.step || event.step == last.step + 1;
  if (is_stop && is_here && event.plan_id == last.plan_id && sender == last.sender) last.plan_id = -1;
}

std::optional<PlanLedger::Departure> PlanLedger::FindDeparture(const transition_t& transition, SenderId sender) const {
  if (transition.num_states < 0 || transition.num_states > static_cast<int>(std::size(transition.next_state)))
    return std::nullopt;
  for (const Place& begin : measured_.places)
    if (begin.plan_id >= 0 && begin.utime == transition.utime && begin.sender == sender)
      return Compare(begin.plan_id, begin.step + 1, {transition.next_state, ToSize(transition.num_states)});
  return std::nullopt;
}

std::optional<PlanLedger::Departure> PlanLedger::Compare(std::int64_t plan_id, int step, std::span<const double> state,
                                                         std::span<const double> state_error) const {
  const auto slices = FindSlices(plan_id);
  if (slices == measured_.slices.end()) return std::nullopt;
  const certified_plan_t& certified = *slices->certified;
  if (step < 0 || step > certified.plan.num_steps || std::ssize(state) != certified.plan.num_states)
    return std::nullopt;
  for (std::size_t k = 0; k < state.size(); ++k) {
    const double value = state[k], error = state_error.empty() ? certified.state_error[k] : state_error[k];
    const double lower = certified.slice_lower[step][k], upper = certified.slice_upper[step][k];
    if (Conform(value, error, lower, upper, slices->angles[k]) == Conformance::kLeft)
      return Departure{plan_id, step, static_cast<int>(k), value, error, lower, upper};
  }
  return std::nullopt;
}

// ---- Strangers.

void PlanLedger::TolerateIssuedUntil(std::int64_t steady_us) {
  tolerates_until_us_ = std::max(tolerates_until_us_, steady_us + LongestLife(kMaxSteps));
}

std::optional<PlanLedger::Stranger> PlanLedger::FindStranger(const robot_state_t& state, std::int64_t steady_us) {
  if (state.mode != robot_state_t::EXECUTING) return std::nullopt;
  std::string why;
  for (Record& record : records_) {  // two sources may have used one plan_id
    if (record.plan_id != state.executing_plan_id || record.ends_us < steady_us) continue;
    why = WhyNot(record, state);
    if (why.empty()) return std::nullopt;
  }
  if (why.empty()) {
    if (steady_us <= tolerates_until_us_) return std::nullopt;
    why = "which was not certified, or should have ended";
  }
  return Stranger{state.executing_plan_id, state.executing_step,
                  fmt::format("the robot executes plan {}, {}", state.executing_plan_id, why)};
}

// Whether it began in time is decided once, by the first received state, because a clock may be set later.
std::string PlanLedger::WhyNot(Record& record, const robot_state_t& state) const {
  if (state.executing_step < 0 || state.executing_step >= record.num_steps)
    return fmt::format("step {} of {}", state.executing_step, record.num_steps);
  if (record.began_in_time) return {};
  const std::int64_t latest = record.expires_utime + delay_us_;
  // Unsigned differences do not overflow, whatever the period that the planner has claimed.
  const auto driven = static_cast<std::uint64_t>(state.executing_step) * static_cast<std::uint64_t>(record.step_us);
  const auto began = static_cast<std::int64_t>(static_cast<std::uint64_t>(state.utime) - driven);
  if (began > latest)
    return fmt::format("which began {} after its certificate had expired", Milliseconds(began, record.expires_utime));
  record.began_in_time = true;
  return {};
}

// ---- Plans in force.

std::size_t PlanLedger::num_in_force() const { return ToSize(std::ranges::count_if(records_, kIsInForce)); }

// Earlier calls have left at most kJudged plans that have not begun.
void PlanLedger::DropOldestJudged() {
  std::size_t kept = 0;
  for (auto record = records_.rbegin(); record != records_.rend() && kept <= kJudged; ++record) {
    InForce* const force = record->force.get();
    if (force && force->judged && !force->has_begun && ++kept > kJudged) force->judged.reset();
  }
}

void PlanLedger::SeeRobot(const robot_state_t& state, std::int64_t steady_us) {
  const StreamPosition position{state.sequence, state.utime};
  if (!IsNews(states_.Compare(position, StreamOrder::kNoHorizon))) return;
  states_.Take(position, StreamOrder::kNoHorizon);
  const bool executes = state.mode == robot_state_t::EXECUTING;
  std::optional<std::int64_t> expires;  // the earliest expiry among the plans that may be the executing one
  for (Record& record : records_) {
    // By the number alone: of two sources' plans with one number each may be the one.
    if (!executes || !record.force || record.plan_id != state.executing_plan_id) continue;
    Begin(record, state, steady_us);
    expires = std::min(expires.value_or(record.expires_utime), record.expires_utime);
  }
  const auto has_left = [&](const Record& record) {
    if (executes && record.plan_id == state.executing_plan_id) return false;
    if (state.mode == robot_state_t::FINISHED) return !record.force->is_shared;
    if (record.force->may_run_until_us < steady_us) return true;
    if (record.force->is_shared) return false;
    // A guard takes an older plan_id only after the newer one has expired.
    const bool is_superseded = expires && record.plan_id < state.executing_plan_id && record.expires_utime <= *expires;
    return is_superseded || record.force->has_begun;
  };
  for (Record& record : records_)
    if (record.force && has_left(record)) record.force.reset();
  std::erase_if(records_, [&](const Record& record) { return HasEnded(record, steady_us); });
  if (executes && !expires && !IsFull()) AppendUnknown(state, steady_us);
}

void PlanLedger::Begin(Record& record, const robot_state_t& state, std::int64_t steady_us) const {
  InForce& force = *record.force;
  force.has_begun = true;
  force.may_run_until_us = steady_us + LongestRun(record.num_steps);
  const int step = StepIn(record.num_steps, state);
  force.first_step = force.is_shared ? std::min(force.first_step, step) : step;
}

// From now on it counts as one that has not begun, so that only kJudged of these are judged.
void PlanLedger::Share(InForce& force) {
  force.has_begun = false;
  force.is_shared = true;
}

void PlanLedger::SeeOneOfTwo(const robot_state_t& state, std::int64_t steady_us) {
  if (state.mode != robot_state_t::EXECUTING) return;
  bool is_in_force = false;
  for (Record& record : records_) {
    if (!record.force || record.plan_id != state.executing_plan_id) continue;
    InForce& force = *record.force;
    Share(force);
    force.may_run_until_us = std::max(force.may_run_until_us, steady_us + LongestRun(record.num_steps));
    force.first_step = std::min(force.first_step, StepIn(record.num_steps, state));
    is_in_force = true;
  }
  if (!is_in_force && !IsFull()) Share(*AppendUnknown(state, steady_us).force);
}

void PlanLedger::RobotHasChanged() {
  states_ = {};
  for (Record& record : records_)
    if (record.force && record.force->has_begun) Share(*record.force);
}

PlanLedger::Record& PlanLedger::AppendUnknown(const robot_state_t& state, std::int64_t steady_us) {
  Record& record = Append(state.executing_plan_id, kMaxSteps);
  Begin(record, state, steady_us);
  record.force->is_changed = is_any_changed_ = true;
  return record;
}

void PlanLedger::TakeAnswer(const execution_event_t& event) {
  for (Record& record : records_) {
    if (record.plan_id != event.plan_id || !record.force) continue;
    InForce& force = *record.force;
    if (!force.withdrawal || force.is_shared) continue;
    // Plans of two sources may have one plan_id: each is answered for itself.
    const auto is_answered = [&](std::int64_t sequence) { return static_cast<double>(sequence) == event.value; };
    if (std::ranges::none_of(force.sent, is_answered)) continue;
    // It has answered an earlier withdrawal, which left more of the plan.
    if (record.is_known && event.step > force.standing_steps) continue;
    force.withdrawal.reset();
    if (record.is_known) force.standing_steps = std::max<int>(event.step, 0);
  }
}

void PlanLedger::SeeObstacles(const std::string& why_unknown, std::int64_t steady_us) {
  why_unknown_ = why_unknown;
  if (why_unknown.empty())
    unknown_since_us_.reset();
  else if (!unknown_since_us_)
    unknown_since_us_ = steady_us;
  unknown_us_ = unknown_since_us_ ? steady_us - *unknown_since_us_ : 0;
}

void PlanLedger::Judge(Gate& gate, std::int64_t now_us, bool is_contradicted) {
  const Grounds grounds = gate.grounds();
  const bool has_lost_obstacles = unknown_since_us_ && lost_us_ && unknown_us_ >= *lost_us_;
  // What was learned is no premise: more observations take nothing back (docs/soundness.md, 3.13).
  const Premises premises{grounds.config, gate.transitions(), grounds.obstacles, is_contradicted, has_lost_obstacles};
  const bool have_changed = premises_ && premises_ != premises;
  premises_ = premises;
  if (!std::exchange(is_any_changed_, false) && !have_changed) return;
  const bool knows_obstacles = gate.WhyObstaclesUnknown(now_us).empty();
  for (Record& record : records_) {
    if (!record.force) continue;
    record.force->is_changed |= have_changed;
    if (!record.force->is_changed) continue;
    // A guard compares the grounds on which an unknown plan is withdrawn, so the obstacles have to be known.
    if (record.is_known || knows_obstacles || has_lost_obstacles)
      Judge(record, gate);
    else
      is_any_changed_ = true;  // later
  }
}

void PlanLedger::Judge(Record& record, Gate& gate) {
  InForce& force = *record.force;
  force.is_changed = false;
  if (record.is_known && force.is_withdrawn && force.standing_steps <= force.first_step) return;  // nothing is left
  if (premises_->has_lost_obstacles)
    return Withdraw(
        record, gate.grounds(),
        Unjudged(
            withdrawal_t::OBSTACLES_LOST,
            fmt::format("the obstacles have been unknown for {}, so nothing stands, and the stop is not certified: {}",
                        Milliseconds(unknown_us_, 0), why_unknown_)));
  if (!record.is_known)
    return Withdraw(
        record, GroundsForStranger(gate, premises_->is_falsified),
        Unjudged(withdrawal_t::UNKNOWN_PLAN, "this certifier has not certified it, and cannot judge whether it holds"));
  if (!force.judged)
    return Withdraw(
        record, gate.grounds(),
        Unjudged(withdrawal_t::NOT_JUDGED, "something has changed, and newer plans are judged in its place"));
  const Standing standing = gate.JudgeAgain(force.judged->plan, UpheldBy(*force.judged), force.first_step);
  if (standing.verdict.outcome == Outcome::kCertified) return;
  if (force.is_withdrawn && standing.steps >= force.standing_steps) return;
  Withdraw(record, gate.grounds(), Judged(standing, gate));
}

void PlanLedger::Withdraw(Record& record, const Grounds& grounds, const withdrawal_t& withdrawal) {
  InForce& force = *record.force;
  force.withdrawal = std::make_unique<withdrawal_t>(withdrawal);
  withdrawal_t& message = *force.withdrawal;
  message.plan_id = record.plan_id;
  std::ranges::copy(force.source, message.source);
  message.expires_utime = record.expires_utime;
  message.first_step = static_cast<std::int16_t>(force.first_step);
  SetDigest(message.plan_digest, force.plan_digest);
  SetDigest(message.certificate_digest, force.certificate_digest);
  SetGrounds(message, grounds);
  force.is_withdrawn = true;
  force.standing_steps = message.valid_steps;
  force.sent.clear();
  // Due at once. Answers to what was sent before do not count.
  force.next_us = INT64_MIN;
  is_any_unanswered_ = true;
  ++withdrawals_;
}

std::optional<PlanLedger::Due> PlanLedger::TakeDue(std::int64_t now_us, std::int64_t steady_us) {
  if (!is_any_unanswered_) return std::nullopt;
  is_any_unanswered_ = false;
  for (Record& record : records_) {
    if (!record.force || !record.force->withdrawal || record.force->may_run_until_us < steady_us) continue;
    is_any_unanswered_ = true;
    InForce& force = *record.force;
    if (force.next_us > steady_us) continue;
    force.next_us = steady_us + kRepeatUs;
    withdrawal_t& message = *force.withdrawal;
    message.utime = now_us;
    message.sequence = sequence_++;
    const bool is_repetition = !force.sent.empty();
    if (force.sent.size() == kMostSent) force.sent.erase(force.sent.begin());
    force.sent.push_back(message.sequence);
    return Due{message, is_repetition};
  }
  return std::nullopt;
}

}  // namespace forereach
