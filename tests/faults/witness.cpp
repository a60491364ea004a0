#include "tests/faults/witness.h"

#include <algorithm>

#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"

namespace forereach {

Witness::Witness(Bus& bus, const BusOptions& channels, const Key256& key) : channels_(channels), authenticator_(key, 0) {
  bus.SubscribeUnchecked(channels_.decision, [this](const Received& r) { OnDecision(r); });
  bus.SubscribeUnchecked(channels_.certified, [this](const Received& r) { OnCertified(r); });
  bus.SubscribeUnchecked(channels_.robot_state, [this](const Received& r) { OnState(r); });
  bus.SubscribeUnchecked(channels_.transition, [this](const Received& r) { OnTransition(r); });
  bus.SubscribeUnchecked(channels_.fault, [this](const Received& r) {
    fault_ = Decoded<fault_t>(WithoutSignature(r.bytes));
    certificates_at_fault_ = certificates_;
  });
  bus.SubscribeUnchecked(channels_.status, [this](const Received& r) {
    if (const auto status = Decoded<certifier_status_v2_t>(r.bytes)) status_ = status;
  });
  bus.SubscribeUnchecked(channels_.logger_status, [this](const Received& r) {
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
}

void Witness::OnCertified(const Received& received) {
  const auto [authenticity, message] = authenticator_.Check(channels_.certified, received.bytes);
  const auto plan = Decoded<certified_plan_t>(message);
  if (authenticity != Authenticity::kAuthentic || !plan || !FindSealFaults(*plan).empty()) return;
  ++certificates_;
  plans_[plan->plan.plan_id] = *plan;
}

void Witness::OnState(const Received& received) {
  robot_heard_ = std::chrono::steady_clock::now();
  const auto state = Decoded<robot_state_t>(WithoutSignature(received.bytes));
  if (!state || state->mode != robot_state_t::EXECUTING) return;
  applied_[state->utime] = {state->executing_plan_id, state->executing_step};
  if (!plans_.contains(state->executing_plan_id))
    Violate("plan " + std::to_string(state->executing_plan_id) + " is executing, and was never passed on");
}

void Witness::OnTransition(const Received& received) {
  const auto transition = Decoded<transition_t>(WithoutSignature(received.bytes));
  if (!transition) return;
  const auto applied = applied_.find(transition->utime);
  if (applied == applied_.end()) return;  // its state did not reach this listener
  const auto plan = plans_.find(applied->second.plan_id);
  if (plan == plans_.end()) return;  // said already
  const double* control = plan->second.plan.control[applied->second.step];
  if (!std::equal(transition->input, transition->input + transition->num_inputs, control))
    Violate("step " + std::to_string(applied->second.step) + " of plan " + std::to_string(applied->second.plan_id) +
            " was driven with another control");
}

}  // namespace forereach
