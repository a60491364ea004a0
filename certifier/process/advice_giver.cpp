#include "certifier/process/advice_giver.h"

#include <utility>

#include "certifier/gate/advice_message.h"
#include "certifier/gate/stamp.h"
#include "lcmtypes/candidate_batch.h"

namespace forereach {
namespace {

constexpr int kHalvings = 4;  // a plan that gives way by a sixteenth too much is no worse

}  // namespace

void AdviceGiver::Note(Bytes candidate, const decision_t& decision, const GateOptions& options) {
  abstained_.reset();
  if (!options.advises || !IsAdvisedOn(decision.cause)) return;
  if (auto decoded = Decoded<candidate_plan_t>(CandidateIn(candidate, GetDigest(decision.plan_digest))))
    abstained_ = {*decoded, decision};
}

std::optional<advice_t> AdviceGiver::Give(Gate& gate, const std::function<bool()>& is_wanted_elsewhere) {
  const auto abstained = std::exchange(abstained_, std::nullopt);
  if (!abstained) return std::nullopt;
  const std::int64_t end = steady_() + Microseconds(gate.options().decision_budget_ms);
  auto advice = gate.Advise(abstained->candidate, abstained->decision,
                            {kHalvings, [&] { return steady_() <= end && !is_wanted_elsewhere(); }});
  if (advice) advice->sequence = given_++;
  return advice;
}

}  // namespace forereach
