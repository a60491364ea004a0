/** Results of runs as the files of shards keep them. */
#pragma once

#include <nlohmann/json.hpp>

#include "bus/authentic.h"
#include "records/event_log.h"
#include "records/export.h"
#include "records/log_trust.h"
#include "records/replay.h"
#include "records/shard.h"

namespace forereach {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Refusals, unsigned_ones, forged, replayed, foreign, old, ahead)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PassedOver, not_authentic, undecodable)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LogDamage, places, bytes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ReplayResult, candidates, agreed, withdrawals, proposals, circumstances, corruptions,
                                   passed_over, differences, shown)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WhyNot, outcome, cause, obstacle, step)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Comparison, candidates, certificates, circumstances, without_candidate, undecided,
                                   gained, lost, otherwise, refused_alike, lost_plans, gained_plans, corruptions,
                                   passed_over)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ExportResult, decisions, without_candidate, executions, withdrawals, gaps, tubes,
                                   messages, left_out, damage, passed_over, has_messages)

template <class Result>
void to_json(nlohmann::json& json, const CaseResults<Result>& results) {
  json = {{"of_run", results.of_run}, {"cases", results.cases}, {"counts", results.counts}, {"told", results.told}};
}
template <class Result>
void from_json(const nlohmann::json& json, CaseResults<Result>& results) {
  json.at("of_run").get_to(results.of_run);
  json.at("cases").get_to(results.cases);
  json.at("counts").get_to(results.counts);
  json.at("told").get_to(results.told);
}

}  // namespace forereach
