/** Results of runs as FinishedRuns keeps them. */
#pragma once

#include <nlohmann/json.hpp>

#include "bus/authentic.h"
#include "records/compare.h"
#include "records/event_log.h"
#include "records/log_trust.h"
#include "records/replay.h"

namespace forereach {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Refusals, unsigned_ones, forged, replayed, foreign)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PassedOver, not_authentic, undecodable)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LogDamage, places, bytes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ReplayResult, candidates, agreed, withdrawals, circumstances, corruptions,
                                   passed_over, differences, shown)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WhyNot, outcome, cause, obstacle, step)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Comparison, candidates, certificates, circumstances, without_candidate, undecided,
                                   gained, lost, otherwise, refused_alike, lost_plans, corruptions, passed_over)

}  // namespace forereach
