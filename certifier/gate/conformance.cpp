#include "certifier/gate/conformance.h"

#include <algorithm>
#include <iterator>

namespace forereach {

void Conformance::Remember(const certified_plan_t& certified) {
  const bool full = plans_.size() == kPlans;
  if (full && last_plan_id_ >= 0 && plans_[next_].plan.plan_id == last_plan_id_) next_ = (next_ + 1) % kPlans;
  if (!full)
    plans_.push_back(certified);
  else
    plans_[next_] = certified;
  next_ = (next_ + 1) % kPlans;
}

std::optional<Conformance::Departure> Conformance::Check(const robot_state_t& state) {
  const std::span<const double> measured(state.state, static_cast<std::size_t>(state.num_states));
  const bool executing = state.mode == robot_state_t::EXECUTING;
  const bool follows = state.sequence > last_sequence_ && state.sequence - 1 == last_sequence_;  // any numbers: no overflow
  std::optional<Departure> departure;
  if (executing && follows && last_plan_id_ >= 0) departure = Compare(last_plan_id_, last_step_ + 1, measured);
  if (executing && !departure) departure = Compare(state.executing_plan_id, state.executing_step, measured);
  last_sequence_ = state.sequence;
  last_utime_ = state.utime;
  last_plan_id_ = executing ? state.executing_plan_id : -1;
  last_step_ = state.executing_step;
  return departure;
}

std::optional<Conformance::Departure> Conformance::Check(const transition_t& transition) const {
  if (last_plan_id_ < 0 || transition.utime != last_utime_ || transition.num_states < 0 ||
      transition.num_states > static_cast<int>(std::size(transition.next_state)))
    return std::nullopt;
  return Compare(last_plan_id_, last_step_ + 1,
                 {transition.next_state, static_cast<std::size_t>(transition.num_states)});
}

std::optional<Conformance::Departure> Conformance::Compare(std::int64_t plan_id, int step,
                                                           std::span<const double> state) const {
  const auto known = std::ranges::find(plans_, plan_id, [](const certified_plan_t& c) { return c.plan.plan_id; });
  if (known == plans_.end() || step < 0 || step > known->plan.num_steps || std::ssize(state) != known->plan.num_states)
    return std::nullopt;
  for (int k = 0; k < known->plan.num_states; ++k) {
    const double value = state[static_cast<std::size_t>(k)];
    const double lower = known->slice_lower[step][k], upper = known->slice_upper[step][k];
    if (!(lower <= value && value <= upper)) return Departure{plan_id, step, k, value, lower, upper};
  }
  return std::nullopt;
}

}  // namespace forereach
