#include "tests/faults/witness.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"

namespace forereach {

Witness::Witness(Bus& bus, const BusOptions& channels, bool spoiled)
    : bus_(bus), channels_(channels), spoiled_(spoiled) {
  bus.Subscribe(channels_.decision, [this](const Received& r) { OnDecision(r); });
  bus.Subscribe(channels_.certified, [this](const Received& r) { OnCertified(r); });
  bus.Subscribe(channels_.event, [this](const Received& r) { OnEvent(r); });
  bus.Subscribe(channels_.robot_state, [this](const Received& r) { OnState(r); });
  bus.Subscribe(channels_.transition, [this](const Received& r) { OnTransition(r); });
  bus.Subscribe(channels_.fault, [this](const Received& r) { OnFault(r); });
  bus.Subscribe(channels_.status, [this](const Received& r) { OnStatus(r); });
  bus.Subscribe(channels_.logger_status, [this](const Received& r) {
    if (const auto status = Decoded<logger_status_t>(r.bytes)) logger_status_ = status;
  });
}

void Witness::OnDecision(const Received& received) {
  const auto decision = Decoded<decision_t>(received.bytes);
  if (!decision) return;
  ++decisions_;
  const Digest digest = DigestOf(received.bytes);
  const auto [known, is_new] = answers_.emplace(GetDigest(decision->plan_digest), Answer{digest, decision->cause});
  // The network may deliver one answer twice. The same bytes sent twice are two candidates; the second is a duplicate.
  if (!is_new && known->second.decision != digest && decision->cause != decision_t::CAUSE_DUPLICATE)
    Violate("plan " + std::to_string(decision->plan_id) + " was answered twice: " +
            std::string(CauseName(known->second.cause)) + ", then " + std::string(CauseName(decision->cause)));
  if (spoiled_) return;
  const auto [numbered, is_new_number] = by_number_.emplace(decision->sequence, digest);
  if (!is_new_number && numbered->second != digest)
    Violate("two decisions have the number " + std::to_string(decision->sequence));
}

// One heartbeat is held against the last: what was counted then has been heard by now, what was heard then is counted
// now. The certifier sends both from one thread, so a decision comes before the heartbeat that counts it.
void Witness::OnStatus(const Received& received) {
  const auto status = Decoded<certifier_status_t>(received.bytes);
  // A certifier that is not in charge decides nothing.
  if (!status || status->state == certifier_status_t::LISTENING || status->state == certifier_status_t::STANDBY) return;
  status_ = status;
  if (spoiled_) return;
  if (status->sequence == 0) {  // a certifier's first sign of life
    earlier_unheard_ += std::exchange(unheard_, 0);
    by_number_.clear();
    counted_ = 0;
    highest_ = -1;
  }
  unheard_ = counted_ - std::distance(by_number_.begin(), by_number_.lower_bound(counted_));
  if (highest_ >= status->candidates)
    Violate("decision " + std::to_string(highest_) + " is not among the " + std::to_string(status->candidates) +
            " candidates that the certifier counts");
  counted_ = status->candidates;
  highest_ = by_number_.empty() ? -1 : by_number_.rbegin()->first;
}

// While it is latched it is said again and again.
void Witness::OnFault(const Received& received) {
  const auto fault = Decoded<fault_t>(received.bytes);
  if (!fault || (fault_ && fault->utime == fault_->utime && fault->sequence == fault_->sequence)) return;
  fault_ = fault;
  certificates_at_fault_ = certificates_;
}

void Witness::OnCertified(const Received& received) {
  const auto plan = Decoded<certified_plan_t>(received.bytes);
  if (!plan || !FindSealFaults(*plan).empty()) return;
  if (!world_.empty() && !world_.contains(GetDigest(plan->obstacles_digest)))
    Violate("plan " + std::to_string(plan->plan.plan_id) + " was certified under other obstacles than there are");
  Certified& certified = plans_[plan->plan.plan_id];
  certified = {*plan, ++certificates_};
  last_certified_ = &certified.plan;
}

void Witness::OnState(const Received& received) {
  robot_heard_ = std::chrono::steady_clock::now();
  const auto state = Decoded<robot_state_t>(received.bytes);
  if (!state || state->mode != robot_state_t::EXECUTING || state->sequence >= kFirstLie) return;
  applied_[state->utime] = {state->executing_plan_id, state->executing_step};
  const auto withdrawn = withdrawn_.find(state->executing_plan_id);
  if (withdrawn != withdrawn_.end() && state->utime > withdrawn->second.utime &&
      state->executing_step >= withdrawn->second.standing_steps)
    Violate("step " + std::to_string(state->executing_step) + " of plan " + std::to_string(state->executing_plan_id) +
            " is executing, and was withdrawn");
  const auto plan = plans_.find(state->executing_plan_id);
  if (plan == plans_.end() && bus_.dropped() > 0) {
    unjudged_.insert(state->executing_plan_id);
    return;
  }
  if (plan == plans_.end())
    return Violate("plan " + std::to_string(state->executing_plan_id) + " is executing, and was never passed on");
  executed_ = std::max(executed_, plan->second.number);
}

void Witness::OnEvent(const Received& received) {
  const auto event = Decoded<execution_event_t>(received.bytes);
  if (!event || event->kind != execution_event_t::WITHDRAWN) return;
  const auto [known, is_new] = withdrawn_.try_emplace(event->plan_id, Withdrawn{event->utime, event->step});
  if (!is_new && event->step < known->second.standing_steps) known->second = {event->utime, event->step};
}

void Witness::OnTransition(const Received& received) {
  const auto transition = Decoded<transition_t>(received.bytes);
  if (!transition) return;
  const auto applied = applied_.find(transition->utime);
  if (applied == applied_.end()) return;  // its state did not reach this listener
  const auto plan = plans_.find(applied->second.plan_id);
  if (plan == plans_.end()) return;  // said already
  const certified_plan_t& certified = plan->second.plan;
  const int step = applied->second.step;
  const std::string which = "step " + std::to_string(step) + " of plan " + std::to_string(applied->second.plan_id);
  if (!std::equal(transition->input, transition->input + transition->num_inputs, certified.plan.control[step]))
    Violate(which + " was driven with another control");
  for (int k = 0; k < transition->num_states; ++k) {
    const double x = transition->state[k], error = certified.state_error[k];
    if (!(certified.slice_lower[step][k] - error <= x && x <= certified.slice_upper[step][k] + error))
      Violate(which + " was driven from outside its slice, in coordinate " + std::to_string(k));
  }
}

}  // namespace forereach
