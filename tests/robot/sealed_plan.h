/** Certified plans for tests, with the digests they need to pass. */
#pragma once

#include <cstdint>
#include <vector>

#include "forereach/certified_plan_t.hpp"
#include "lcmtypes/seal.h"

namespace forereach {

/** Sets plan_digest and certificate_digest to what they have to be. */
inline void Seal(certified_plan_t& certified) {
  SetDigest(certified.plan_digest, DigestOf(Encode(certified.plan)));
  SetDigest(certified.certificate_digest, CertificateDigest(certified));
}

inline std::vector<std::uint8_t> Sealed(certified_plan_t certified) {
  Seal(certified);
  return Encode(certified);
}

}  // namespace forereach
