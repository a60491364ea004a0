/** The advice on recorded abstentions, for `forereach advise` and for the page of `forereach report`. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "advise/abstentions.h"
#include "advise/advice.h"
#include "advise/gate_advice.h"
#include "records/finished_runs.h"

namespace forereach {

/** Of one abstention. Kept results lack Advice::after. */
struct AbstentionAdvice {
  std::vector<Advice> advices;   ///< None if it was answered without a judgement.
  std::optional<Remedy> remedy;  ///< Only then.
  std::string missing;           ///< Why there is none, or how a judgement by what is recorded differs.

  [[nodiscard]] bool turned() const;
};

/** As a person reads it: a heading, and the clauses below it. */
struct AdviceGroup {
  std::string heading;  ///< "it would be certified", "not enough alone", "it would be judged", "it might be judged"
  std::vector<std::string> clauses;
};
[[nodiscard]] std::vector<AdviceGroup> GroupsOf(const AbstentionAdvice& advice);

/** The fields `advice`, and `missing` and `remedy` if there are such. */
void to_json(nlohmann::json& json, const AbstentionAdvice& advice);
void from_json(const nlohmann::json& json, AbstentionAdvice& advice);

/** What would have turned the abstentions of several runs, on `jobs` threads in all and with a progress bar.
@param keys of each run, as FinishedRuns names it. @param finished where the advice of finished runs is kept; null for
none, without keys. @param seconds after this time no further one is begun, but for the first; the others have
`missing`. Those that missed by least come first. @throws OutputError if a result cannot be kept. */
[[nodiscard]] std::vector<std::vector<AbstentionAdvice>> AdviseAll(const std::vector<Abstentions>& runs, unsigned jobs,
                                                                   const FinishedRuns* finished = nullptr,
                                                                   const std::vector<std::string>& keys = {},
                                                                   double seconds = kInfinity);

}  // namespace forereach
