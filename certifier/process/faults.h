/** The faults that a certifier latches, as messages with a sentence. */
#pragma once

#include <cstdint>
#include <string>

#include "certifier/gate/plan_ledger.h"
#include "forereach/fault_t.hpp"
#include "forereach/residual/consistency.h"

namespace forereach {

/** A fault_t with its cause and witness; what it does not use is -1, or 0 for values. utime, sequence, state,
transition and message are the sender's to fill in. */
struct FoundFault {
  fault_t fault;
  std::string why;  ///< One sentence with the values.
};

/** A fault without a witness. @param cause a constant of fault_t. */
[[nodiscard]] FoundFault PlainFault(std::int16_t cause, std::string why);
/** SLICE_LEFT: a measured state lies outside its certified slice. */
[[nodiscard]] FoundFault SliceLeft(const PlanLedger::Departure& departure);
/** UNCERTIFIED_PLAN: the robot executes what no certifier has issued. */
[[nodiscard]] FoundFault UncertifiedPlan(const PlanLedger::Stranger& stranger);
/** DECLARATION_FALSIFIED: an executed transition, the second observation of the pair, contradicts the declaration; in
an affine row (AsViolation) with a few others; or, without a second one, the first contradicts a declared rate. */
[[nodiscard]] FoundFault DeclarationFalsified(const Violation& violation, const AffineRows& affine);

}  // namespace forereach
