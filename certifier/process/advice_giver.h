/** Advice on the newest abstention, for when there is nothing else to do (docs/decisions.md): the repair that its
candidate asks for; without one, with gate.advice, what would have helped.

It keeps one candidate at most: a newer decision displaces it, because its planner has gone on. A search ends without a
result when `is_wanted_elsewhere` says so, and when its time is up with the repair that was found, if one was. It is not
tried again. So however many candidates ask, they get one search of gate.decision_budget_ms at a time, and none while
anything else waits. It uses no bus. */
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "bus/clock.h"
#include "certifier/gate/gate.h"

namespace forereach {

class AdviceGiver final {
 public:
  /** @param steady a monotonic clock, microseconds. */
  explicit AdviceGiver(Clock steady) : steady_(std::move(steady)) {}

  /** Takes note of a decision. Cost: a copy of the candidate. @param candidate its bytes. */
  void Note(Bytes candidate, const decision_t& decision, const GateOptions& options);

  /** Whether there is something to say. */
  [[nodiscard]] bool has_work() const { return abstained_.has_value(); }

  /** The advice, complete but for its utime; nothing if the search ended without one, which a search for a repair says
  by advice without a proposal. Then there is no work any more.
  It takes as long as two decisions and a test of one obstacle after `is_wanted_elsewhere` became true, at most, and
  else not longer than that after gate.decision_budget_ms. */
  [[nodiscard]] std::optional<advice_t> Give(Gate& gate, const std::function<bool()>& is_wanted_elsewhere);

 private:
  struct Abstained {
    candidate_plan_t candidate;
    decision_t decision;
    bool says_changes;
  };

  const Clock steady_;
  std::optional<Abstained> abstained_;
  std::int64_t given_ = 0;
};

}  // namespace forereach
