#include "records/certified_message.h"

#include <cstring>

#include "forereach/certified_plan_t.hpp"
#include "lcmtypes/grounds.h"

namespace forereach {
namespace {

certified_plan_v2_t Renewed(const certified_plan_t& old) {
  certified_plan_v2_t plan{};
  plan.utime = old.utime;
  plan.sequence = old.sequence;
  plan.expires_utime = old.expires_utime;
  plan.plan = old.plan;
  std::memcpy(plan.slice_lower, old.slice_lower, sizeof plan.slice_lower);
  std::memcpy(plan.slice_upper, old.slice_upper, sizeof plan.slice_upper);
  SetDigest(plan.plan_digest, GetDigest(old.plan_digest));
  SetGrounds(plan, GroundsOf(old));
  SetDigest(plan.certificate_digest, GetDigest(old.certificate_digest));
  return plan;
}

}  // namespace

std::optional<CertifiedMessage> ReadCertified(Bytes message) {
  if (const auto plan = Decoded<certified_plan_v2_t>(message))
    return CertifiedMessage{*plan, true, FindSealFaults(*plan)};
  if (const auto plan = Decoded<certified_plan_t>(message))
    return CertifiedMessage{Renewed(*plan), false, FindSealFaults(*plan)};
  return std::nullopt;
}

}  // namespace forereach
