/** The advice on recorded abstentions, for `forereach advise` and for the page of `forereach report`. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "advise/abstentions.h"
#include "advise/advice.h"
#include "advise/case.h"
#include "advise/gate_advice.h"
#include "forereach/certify/certifier.h"
#include "records/shard.h"

namespace forereach {

/** Of a plan that was abstained from: what every sound method has to count with. */
struct InnerBound {
  int step = 0;         ///< The last one to which the certifier's tube was computed.
  double half_width;    ///< m, of its slice there: rho_P.
  double least;         ///< Half the spread there of systems that agree with all data: no sound tube is narrower.
  std::string contact;  ///< The claim that such a system provably breaks; empty if none was found.
};

/** By rollouts of the extremal residuals (forereach/certify/extremal.h) from the center and the corners of X_0. `least`
is true up to the rounding of these; the contact is confirmed by the verifier in 256 bits.
@param tube of Certify for the case. Nothing if X_0 is no box, rows are affine, regions or an error in z are declared, p
is not 2, or it would take long: more than kMostInnerObservations, or six varying coordinates or states with a width. */
[[nodiscard]] std::optional<InnerBound> BoundFromWithin(const Case& judged, const Certifier& certifier,
                                                        const Tube& tube);

inline constexpr int kMostInnerObservations = 4000, kMostInnerCoordinates = 6;

/** "half-width at step 12: 1.02 m; no sound tube is below 0.871 m", and the contact. */
[[nodiscard]] std::string Describe(const InnerBound& bound);

/** Of one abstention. */
struct AbstentionAdvice {
  std::vector<Advice> advices;           ///< None if it was answered without a judgement.
  std::optional<Remedy> remedy;          ///< Only then.
  std::string missing;                   ///< Why there is none, or how a judgement by what is recorded differs.
  std::optional<InnerBound> inner = {};  ///< If it was asked for.

  [[nodiscard]] bool turned() const;
};

/** As a person reads it: a heading, and the clauses below it. "it would be certified" has the first change of each
kind, the cheapest kind first: "move: if it passed farther away". Behind it, folded, come "other changes that certify
it" and "not enough alone". A candidate without a judgement has "it would be judged" or "it might be judged". */
struct AdviceGroup {
  std::string heading;
  bool is_folded = false;  ///< For those who ask for it.
  std::vector<std::string> clauses = {};
};
[[nodiscard]] std::vector<AdviceGroup> GroupsOf(const AbstentionAdvice& advice);

/** The fields `advice`, and `missing` and `remedy` if there are such. */
void to_json(nlohmann::json& json, const AbstentionAdvice& advice);

/** What would have turned the abstentions of several runs, on `jobs` threads in all and with a progress bar.
@param seconds after this time no further one is begun, but for the first; the others have `missing`. Those that missed
by least come first. @param with_inner asks for the inner bound of what was judged. @param shard of each run's
abstentions; the others have no advice. */
[[nodiscard]] std::vector<std::vector<AbstentionAdvice>> AdviseAll(const std::vector<Abstentions>& runs, unsigned jobs,
                                                                   double seconds, bool with_inner = false,
                                                                   const Shard& shard = {});

/** What is searched for in a run, in the order of its abstentions: as the files of shards keep it. */
struct AdviceOfRun {
  std::vector<AbstentionAdvice> advice;

  AdviceOfRun& operator+=(AdviceOfRun&& more);
};
void to_json(nlohmann::json& json, const AdviceOfRun& of_run);
void from_json(const nlohmann::json& json, AdviceOfRun& of_run);

}  // namespace forereach
