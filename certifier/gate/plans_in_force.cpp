#include "certifier/gate/plans_in_force.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "certifier/gate/stamp.h"
#include "forereach/certify/explain.h"
#include "forereach/numerics/limits.h"

namespace forereach {
namespace {

// The bus contract fixes the numbers, so they are the same on both sides.
static_assert(static_cast<int>(Cause::kPairwise) == withdrawal_t::FALSIFIED &&
              static_cast<int>(Cause::kDomainExit) == withdrawal_t::DOMAIN_EXIT &&
              static_cast<int>(Cause::kNoFiniteEnclosure) == withdrawal_t::NO_FINITE_ENCLOSURE &&
              static_cast<int>(Cause::kObstacle) == withdrawal_t::OBSTACLE &&
              static_cast<int>(Cause::kNoStop) == withdrawal_t::NO_STOP &&
              static_cast<int>(Cause::kLimit) == withdrawal_t::LIMIT);

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

withdrawal_t Judged(const Standing& standing, const Problem& problem) {
  const Decision& verdict = standing.verdict;
  if (verdict.outcome == Outcome::kNone) return Unjudged(withdrawal_t::NOT_JUDGED, "it cannot be judged again");
  withdrawal_t message{};
  message.cause = static_cast<std::int16_t>(verdict.cause);
  message.step = static_cast<std::int16_t>(verdict.step);
  message.obstacle = static_cast<std::int16_t>(verdict.obstacle);
  message.margin = verdict.margin;
  message.threshold = verdict.threshold;
  SetText(message.message,
          "the first " + std::to_string(standing.steps) + " controls stand; now " + Explain(verdict, problem));
  return message;
}

int StepIn(int num_steps, const robot_state_t& state) { return std::clamp<int>(state.executing_step, 0, num_steps); }

}  // namespace

void PlansInForce::Follow(const GateOptions& gate) {
  lifetime_us_ = Microseconds(gate.certificate_lifetime_ms);
  delay_us_ = Microseconds(gate.max_age_ms);
  step_us_ = Microseconds(gate.longest_step_ms);
  const double lost_ms = gate.obstacles_lost_ms.value_or(kNeverLost);
  lost_us_ = lost_ms == kNeverLost ? std::nullopt : std::optional(Microseconds(lost_ms));
  silence_us_ = gate.needs_robot_state ? std::optional(Microseconds(gate.robot_timeout_ms)) : std::nullopt;
}

// The messages with its first and its last state may each be delayed.
std::int64_t PlansInForce::LongestRun(int num_steps) const { return 2 * delay_us_ + num_steps * step_us_; }

void PlansInForce::Add(const certified_plan_t& certified, std::int64_t steady_us) {
  while (!plans_.empty() && plans_.front().may_run_until_us < steady_us) plans_.pop_front();
  const candidate_plan_t& plan = certified.plan;
  Entry entry;
  entry.plan_id = plan.plan_id;
  entry.expires_utime = certified.expires_utime;
  // A robot that has begun it reports this before its states count as lost.
  entry.may_run_until_us =
      steady_us + lifetime_us_ + (silence_us_ ? 2 * delay_us_ + *silence_us_ : LongestRun(plan.num_steps));
  entry.is_known = true;
  std::ranges::copy(plan.source, entry.source.begin());
  entry.plan_digest = GetDigest(certified.plan_digest);
  entry.certificate_digest = GetDigest(certified.certificate_digest);
  entry.plan = std::make_unique<const candidate_plan_t>(plan);
  entry.num_steps = entry.standing_steps = plan.num_steps;
  plans_.push_back(std::move(entry));
  DropOldest();
}

// Earlier calls have left at most kJudged plans that have not begun.
void PlansInForce::DropOldest() {
  std::size_t kept = 0;
  for (auto entry = plans_.rbegin(); entry != plans_.rend() && kept <= kJudged; ++entry)
    if (entry->plan && !entry->has_begun && ++kept > kJudged) entry->plan.reset();
}

void PlansInForce::SeeRobot(const robot_state_t& state, std::int64_t steady_us) {
  const StreamPosition position{state.sequence, state.utime};
  if (!IsNews(states_.Compare(position, StreamOrder::kNoHorizon))) return;
  states_.Take(position, StreamOrder::kNoHorizon);
  if (state.mode == robot_state_t::FINISHED) {
    std::erase_if(plans_, [](const Entry& entry) { return !entry.is_shared; });
    return;
  }
  const bool executes = state.mode == robot_state_t::EXECUTING;
  bool is_known = false;
  std::int64_t expires = INT64_MIN;  // the earliest expiry among the plans that may be the executing one
  for (Entry& entry : plans_) {
    if (!executes || entry.plan_id != state.executing_plan_id) continue;
    Begin(entry, state, steady_us);
    expires = is_known ? std::min(expires, entry.expires_utime) : entry.expires_utime;
    is_known = true;
  }
  std::erase_if(plans_, [&](const Entry& entry) {
    if (executes && entry.plan_id == state.executing_plan_id) return false;
    if (entry.is_shared) return entry.may_run_until_us < steady_us;
    const bool is_superseded = executes && entry.plan_id < state.executing_plan_id && entry.expires_utime <= expires;
    return entry.has_begun || is_superseded || entry.may_run_until_us < steady_us;
  });
  if (executes && !is_known && !IsFull()) RememberStranger(state, steady_us);
}

void PlansInForce::Begin(Entry& entry, const robot_state_t& state, std::int64_t steady_us) const {
  entry.has_begun = true;
  entry.may_run_until_us = steady_us + LongestRun(entry.num_steps);
  const int step = StepIn(entry.num_steps, state);
  entry.first_step = entry.is_shared ? std::min(entry.first_step, step) : step;
}

// From now on it counts as one that has not begun, so that only kJudged of these are judged.
void PlansInForce::Share(Entry& entry) {
  entry.has_begun = false;
  entry.is_shared = true;
}

void PlansInForce::SeeOneOfTwo(const robot_state_t& state, std::int64_t steady_us) {
  if (state.mode != robot_state_t::EXECUTING) return;
  bool is_known = false;
  for (Entry& entry : plans_) {
    if (entry.plan_id != state.executing_plan_id) continue;
    Share(entry);
    entry.may_run_until_us = std::max(entry.may_run_until_us, steady_us + LongestRun(entry.num_steps));
    entry.first_step = std::min(entry.first_step, StepIn(entry.num_steps, state));
    is_known = true;
  }
  if (is_known || IsFull()) return;
  RememberStranger(state, steady_us);
  Share(plans_.back());
}

void PlansInForce::RobotHasChanged() {
  states_ = {};
  for (Entry& entry : plans_)
    if (entry.has_begun) Share(entry);
}

void PlansInForce::RememberStranger(const robot_state_t& state, std::int64_t steady_us) {
  Entry entry;
  entry.plan_id = state.executing_plan_id;
  entry.num_steps = kMaxSteps;
  Begin(entry, state, steady_us);
  entry.is_changed = is_any_changed_ = true;
  plans_.push_back(std::move(entry));
}

void PlansInForce::TakeAnswer(const execution_event_t& event) {
  for (Entry& entry : plans_) {
    if (entry.plan_id != event.plan_id || !entry.withdrawal || entry.is_shared) continue;
    // Plans of two sources may have one plan_id: each is answered for itself.
    const auto is_answered = [&](std::int64_t sequence) { return static_cast<double>(sequence) == event.value; };
    if (std::ranges::none_of(entry.sent, is_answered)) continue;
    if (entry.is_known && event.step > entry.standing_steps) continue;
    entry.withdrawal.reset();
    if (entry.is_known) entry.standing_steps = std::max<int>(event.step, 0);
  }
}

void PlansInForce::SeeObstacles(const std::string& why_unknown, std::int64_t steady_us) {
  why_unknown_ = why_unknown;
  if (why_unknown.empty())
    unknown_since_us_.reset();
  else if (!unknown_since_us_)
    unknown_since_us_ = steady_us;
  unknown_us_ = unknown_since_us_ ? steady_us - *unknown_since_us_ : 0;
}

void PlansInForce::Judge(Gate& gate, std::int64_t now_us, bool is_contradicted) {
  const Grounds grounds = gate.grounds();
  const bool has_lost_obstacles = unknown_since_us_ && lost_us_ && unknown_us_ >= *lost_us_;
  const Premises premises{grounds.config, gate.transitions(), grounds.obstacles, is_contradicted, has_lost_obstacles};
  if (premises_ != premises) {
    if (premises_)
      for (Entry& entry : plans_) entry.is_changed = is_any_changed_ = true;
    premises_ = premises;
  }
  if (!std::exchange(is_any_changed_, false)) return;
  const bool knows_obstacles = gate.WhyObstaclesUnknown(now_us).empty();
  for (Entry& entry : plans_) {
    if (!entry.is_changed) continue;
    if (entry.is_known || knows_obstacles || has_lost_obstacles)
      Judge(entry, gate);
    else
      is_any_changed_ = true;  // later
  }
}

void PlansInForce::Judge(Entry& entry, Gate& gate) {
  entry.is_changed = false;
  if (premises_->has_lost_obstacles) return WithdrawForObstacles(entry, gate);
  if (!entry.is_known) {
    withdrawal_t message =
        Unjudged(withdrawal_t::UNKNOWN_PLAN, "this certifier has not certified it, and cannot judge whether it holds");
    SetGrounds(message, GroundsForStranger(gate, premises_->is_falsified));
    return Withdraw(entry, message);
  }
  if (entry.is_withdrawn && entry.standing_steps <= entry.first_step) return;  // nothing is left
  Standing standing;
  if (entry.plan) standing = gate.JudgeAgain(*entry.plan, entry.first_step);
  if (standing.verdict.outcome == Outcome::kCertified) return;
  if (entry.is_withdrawn && standing.steps >= entry.standing_steps) return;
  withdrawal_t message =
      entry.plan ? Judged(standing, gate.certifier().problem())
                 : Unjudged(withdrawal_t::NOT_JUDGED, "something has changed, and newer plans are judged in its place");
  message.valid_steps = static_cast<std::int16_t>(standing.steps);
  SetGrounds(message, gate.grounds());
  Withdraw(entry, message);
}

void PlansInForce::WithdrawForObstacles(Entry& entry, const Gate& gate) {
  if (entry.is_known && entry.is_withdrawn && entry.standing_steps <= entry.first_step) return;
  withdrawal_t message =
      Unjudged(withdrawal_t::OBSTACLES_LOST, "the obstacles have been unknown for " + Milliseconds(unknown_us_, 0) +
                                                 ", so nothing stands, and the stop is not certified: " + why_unknown_);
  SetGrounds(message, gate.grounds());
  Withdraw(entry, message);
}

void PlansInForce::Withdraw(Entry& entry, const withdrawal_t& withdrawal) {
  entry.withdrawal = std::make_unique<withdrawal_t>(withdrawal);
  withdrawal_t& message = *entry.withdrawal;
  message.plan_id = entry.plan_id;
  std::ranges::copy(entry.source, message.source);
  message.expires_utime = entry.expires_utime;
  message.first_step = static_cast<std::int16_t>(entry.first_step);
  SetDigest(message.plan_digest, entry.plan_digest);
  SetDigest(message.certificate_digest, entry.certificate_digest);
  entry.is_withdrawn = true;
  entry.standing_steps = message.valid_steps;
  entry.sent.clear();
  entry.next_us = INT64_MIN;
  is_any_unanswered_ = true;
  ++withdrawals_;
}

std::optional<PlansInForce::Due> PlansInForce::TakeDue(std::int64_t now_us, std::int64_t steady_us) {
  if (!is_any_unanswered_) return std::nullopt;
  is_any_unanswered_ = false;
  for (Entry& entry : plans_) {
    if (!entry.withdrawal || entry.may_run_until_us < steady_us) continue;
    is_any_unanswered_ = true;
    if (entry.next_us > steady_us) continue;
    entry.next_us = steady_us + kRepeatUs;
    withdrawal_t& message = *entry.withdrawal;
    message.utime = now_us;
    message.sequence = sequence_++;
    const bool is_repetition = !entry.sent.empty();
    if (entry.sent.size() == kMostSent) entry.sent.pop_front();
    entry.sent.push_back(message.sequence);
    return Due{message, is_repetition};
  }
  return std::nullopt;
}

}  // namespace forereach
