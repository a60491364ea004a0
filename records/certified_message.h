/** A certified plan as logs hold it: a certified_plan_v2_t or, of certifiers before it, a certified_plan_t. */
#pragma once

#include <optional>
#include <vector>

#include "forereach/certified_plan_v2_t.hpp"
#include "lcmtypes/codec.h"
#include "lcmtypes/seal.h"

namespace forereach {

struct CertifiedMessage {
  certified_plan_v2_t plan;
  bool names_transitions = true;       ///< False for a certified_plan_t: `plan.transitions_digest` is zero.
  std::vector<SealFault> seal_faults;  ///< Of the message as it was sent.
};

/** Nothing for bytes of another type. Cost: that of FindSealFaults. */
[[nodiscard]] std::optional<CertifiedMessage> ReadCertified(Bytes message);

}  // namespace forereach
