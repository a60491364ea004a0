#include "certifier/gate/conformance.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "forereach/numerics/size.h"

namespace forereach {

void Conformance::Remember(const certified_plan_t& certified, const Angles& angles) {
  if (const auto known = Find(certified.plan.plan_id); known != plans_.end()) {
    if (certified.plan.plan_id != last_.plan_id) plans_[ToSize(known - plans_.begin())] = {certified, angles};
    return;
  }
  const bool full = plans_.size() == kPlans;
  if (full && last_.plan_id >= 0 && plans_[next_].certified.plan.plan_id == last_.plan_id) next_ = (next_ + 1) % kPlans;
  if (!full)
    plans_.push_back({certified, angles});
  else
    plans_[next_] = {certified, angles};
  next_ = (next_ + 1) % kPlans;
}

std::optional<Conformance::Departure> Conformance::Check(const robot_state_t& state, SenderId sender) {
  const std::span<const double> measured(state.state, ToSize(state.num_states));
  const bool executing = state.mode == robot_state_t::EXECUTING;
  const StreamPosition position{state.sequence, state.utime};
  const Succession succession = order_.Compare(position, StreamOrder::kNoHorizon);
  const bool follows = succession == Succession::kNewer && order_.newest() &&
                       state.sequence - 1 == order_.newest()->sequence && last_.sender == sender;
  std::optional<Departure> departure;
  if (executing && follows && last_.plan_id >= 0) departure = Compare(last_.plan_id, last_.step + 1, measured);
  if (executing && !departure) departure = Compare(state.executing_plan_id, state.executing_step, measured);
  // A late state does not tell where the robot is now.
  if (IsNews(succession) || succession == Succession::kRewound) {
    order_.Take(position, StreamOrder::kNoHorizon);
    last_ = {state.utime, executing ? state.executing_plan_id : -1, state.executing_step, sender};
    places_[next_place_] = last_;
    next_place_ = (next_place_ + 1) % kPlaces;
  }
  return departure;
}

std::optional<Conformance::Departure> Conformance::Check(const transition_t& transition, SenderId sender) const {
  if (transition.num_states < 0 || transition.num_states > static_cast<int>(std::size(transition.next_state)))
    return std::nullopt;
  for (const Place& begin : places_)
    if (begin.plan_id >= 0 && begin.utime == transition.utime && begin.sender == sender)
      return Compare(begin.plan_id, begin.step + 1, {transition.next_state, ToSize(transition.num_states)});
  return std::nullopt;
}

std::vector<Conformance::Known>::const_iterator Conformance::Find(std::int64_t plan_id) const {
  return std::ranges::find(plans_, plan_id, [](const Known& known) { return known.certified.plan.plan_id; });
}

std::optional<Conformance::Departure> Conformance::Compare(std::int64_t plan_id, int step,
                                                           std::span<const double> state) const {
  const auto known = Find(plan_id);
  if (known == plans_.end()) return std::nullopt;
  const certified_plan_t& certified = known->certified;
  if (step < 0 || step > certified.plan.num_steps || std::ssize(state) != certified.plan.num_states)
    return std::nullopt;
  for (int k = 0; k < certified.plan.num_states; ++k) {
    const double value = state[ToSize(k)];
    const double lower = certified.slice_lower[step][k], upper = certified.slice_upper[step][k];
    if (!LiesWithin(value, lower, upper, known->angles[ToSize(k)]))
      return Departure{plan_id, step, k, value, lower, upper};
  }
  return std::nullopt;
}

}  // namespace forereach
