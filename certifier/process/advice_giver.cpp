#include "certifier/process/advice_giver.h"

#include "certifier/gate/advice_message.h"
#include "certifier/gate/repair.h"
#include "certifier/gate/stamp.h"
#include "lcmtypes/candidate_batch.h"

namespace forereach {
namespace {

constexpr int kHalvings = 4;  // a plan that gives way by a sixteenth too much is no worse

}  // namespace

void AdviceGiver::Note(Bytes candidate, const decision_t& decision, const GateOptions& options) {
  abstained_.reset();
  if (decision.outcome != decision_t::ABSTAIN_DOMAIN && decision.outcome != decision_t::ABSTAIN_SAFETY) return;
  const auto decoded = Decoded<candidate_plan_t>(CandidateIn(candidate, GetDigest(decision.plan_digest)));
  if (!decoded) return;
  const bool says_changes = options.advises && IsAdvisedOn(decision.cause);
  if (says_changes || AsksForRepair(*decoded, decision)) abstained_ = {*decoded, decision, says_changes};
}

std::optional<advice_t> AdviceGiver::Give(Gate& gate, const std::function<bool()>& is_wanted_elsewhere) {
  const auto abstained = std::exchange(abstained_, std::nullopt);
  if (!abstained) return std::nullopt;
  const auto& [candidate, decision, says_changes] = *abstained;
  const std::int64_t end = steady_() + Microseconds(gate.options().decision_budget_ms);
  const SearchEffort effort{kHalvings, [&] { return steady_() <= end && !is_wanted_elsewhere(); }};
  auto advice = gate.Repair(candidate, decision, effort.goes_on);
  if (says_changes && (!advice || advice->changed == 0))
    if (auto changes = gate.Advise(candidate, decision, effort)) advice = std::move(changes);
  if (is_wanted_elsewhere()) return std::nullopt;
  if (advice) advice->sequence = given_++;
  return advice;
}

}  // namespace forereach
