#include "certifier/gate/issued_plans.h"

#include <algorithm>

#include "certifier/gate/stamp.h"
#include "forereach/numerics/limits.h"

namespace forereach {

IssuedPlans::IssuedPlans(const GateOptions& gate, std::int64_t steady_us) {
  Follow(gate);
  TolerateFrom(steady_us);
}

void IssuedPlans::Follow(const GateOptions& gate) {
  lifetime_us_ = Microseconds(gate.certificate_lifetime_ms);
  delay_us_ = Microseconds(gate.max_age_ms);
  step_us_ = Microseconds(gate.longest_step_ms);
}

void IssuedPlans::TolerateFrom(std::int64_t steady_us) {
  tolerates_until_us_ = std::max(tolerates_until_us_, steady_us + LongestLife(kMaxSteps));
}

// A plan begins before it expires, by a clock that may be behind by the age of a fresh message. Then it runs all its
// steps, and the message with its last state may be delayed by the same time.
std::int64_t IssuedPlans::LongestLife(int num_steps) const {
  return lifetime_us_ + 2 * delay_us_ + num_steps * step_us_;
}

void IssuedPlans::Add(const certified_plan_t& certified, std::int64_t steady_us) {
  while (!issued_.empty() && issued_.front().may_run_until_us < steady_us) issued_.pop_front();
  if (issued_.size() == kPlans) {
    tolerates_until_us_ = std::max(tolerates_until_us_, issued_.front().may_run_until_us);
    issued_.pop_front();
  }
  const candidate_plan_t& plan = certified.plan;
  issued_.push_back({plan.plan_id, certified.expires_utime, plan.step_us, steady_us + LongestLife(plan.num_steps),
                     plan.num_steps, false});
}

std::optional<IssuedPlans::Stranger> IssuedPlans::FindStranger(const robot_state_t& state, std::int64_t steady_us) {
  if (state.mode != robot_state_t::EXECUTING) return std::nullopt;
  std::string why;
  for (Issued& issued : issued_) {  // two sources may have used one plan_id
    if (issued.plan_id != state.executing_plan_id || issued.may_run_until_us < steady_us) continue;
    why = WhyNot(issued, state);
    if (why.empty()) return std::nullopt;
  }
  if (why.empty()) {
    if (steady_us <= tolerates_until_us_) return std::nullopt;
    why = "which was not certified, or should have ended";
  }
  return Stranger{state.executing_plan_id, state.executing_step,
                  "the robot executes plan " + std::to_string(state.executing_plan_id) + ", " + why};
}

// Whether it began in time is decided once, by the first received state, because a clock may be set later.
std::string IssuedPlans::WhyNot(Issued& issued, const robot_state_t& state) const {
  if (state.executing_step < 0 || state.executing_step >= issued.num_steps)
    return "step " + std::to_string(state.executing_step) + " of " + std::to_string(issued.num_steps);
  if (issued.has_begun) return {};
  const std::int64_t latest = issued.expires_utime + delay_us_;
  // Unsigned differences do not overflow, whatever the period that the planner has claimed.
  const auto driven = static_cast<std::uint64_t>(state.executing_step) * static_cast<std::uint64_t>(issued.step_us);
  const auto began = static_cast<std::int64_t>(static_cast<std::uint64_t>(state.utime) - driven);
  if (began > latest)
    return "which began " + Milliseconds(began, issued.expires_utime) + " after its certificate had expired";
  issued.has_begun = true;
  return {};
}

}  // namespace forereach
