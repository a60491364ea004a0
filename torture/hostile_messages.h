/** Messages as a hostile or broken planner and sender make them: for `forereach torture`, and for the fault campaign.
 */
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "bus/bus_options.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"

namespace forereach {

using RawMessage = std::vector<std::uint8_t>;

/** The sequence of forged withdrawals, advice and obstacles, which no honest sender reaches. */
inline constexpr std::int64_t kForgedSequence = std::int64_t{1} << 40;

/** What is wrong with a candidate. No gate may judge it, whatever its task is. */
struct CandidateFlaw {
  const char* name;
  /** Messages with this flaw, made of a candidate without one at this time, microseconds. */
  std::vector<RawMessage> (*make)(const candidate_plan_t& honest, std::int64_t now_us);
};
[[nodiscard]] std::span<const CandidateFlaw> CandidateFlaws();

/** What is wrong with a certificate. No guard may accept it, signed or not. */
struct CertificateFlaw {
  const char* name;
  certified_plan_t (*make)(certified_plan_t honest, std::int64_t now_us);
};
[[nodiscard]] std::span<const CertificateFlaw> CertificateFlaws();

/** The certificate under a seal that holds. */
[[nodiscard]] certified_plan_t Sealed(certified_plan_t certified);
/** What an attacker's certificate looks like: slices that nothing leaves, for a plan that starts soon. */
[[nodiscard]] certified_plan_t Widened(certified_plan_t certified, std::int64_t now_us);

/** For each signed channel a message that would do harm if it were believed; what was heard last where that is harm
enough. @param heard by channel, signed or not. @param certified the last certificate; null: none was heard. */
[[nodiscard]] std::map<std::string, RawMessage> HarmfulMessages(const BusOptions& channels,
                                                                const std::map<std::string, RawMessage>& heard,
                                                                const certified_plan_t* certified, std::int64_t now_us);

}  // namespace forereach
