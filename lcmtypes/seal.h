/** The seal of a certified plan. It detects every changed bit.

`certificate_digest` is the BLAKE2b-256 of the message's bytes in their order on the bus, big-endian and with the
fingerprint, without three parts:
- `plan`; it is represented by `plan_digest`, the PlanDigest of its bytes as a candidate_plan_t;
- the unused entries: those of slices with t > plan.num_steps or k >= plan.num_states, of state_error with
  k >= plan.num_states;
- `certificate_digest` itself.
So the seal holds only if `plan_digest` is the digest of the plan (which also determines the entries in use) and every
bit of the unused entries is zero. If num_steps or num_states is out of range, no entry is in use.

The seal detects damage and mix-ups. It is not a signature: every writer of a message can compute its seal. */
#pragma once

#include <string>
#include <vector>

#include "forereach/certified_plan_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

/** What represents a candidate: BLAKE2b-256 of the number of its bytes, 8 bytes big-endian, and of these bytes without
the zeros at their end. Both together determine all bytes, so different bytes have different digests as surely as with
all of them. Most of a candidate are controls that are not in use, and zero. Cost: a digest of the bytes up to the last
that is not zero, and a look at the others. */
[[nodiscard]] Digest PlanDigest(Bytes candidate);
[[nodiscard]] inline Digest PlanDigest(const candidate_plan_t& candidate) {
  return PlanDigest(Bytes(Encode(candidate)));
}

/** The correct value of `certificate_digest`. Cost: a digest of 264 bytes, plus 8 bytes for each state, and 16 for each
state of each slice. */
[[nodiscard]] Digest CertificateDigest(const certified_plan_t& certified);

/** A violation of a seal. */
struct SealFault {
  enum class Kind { kPlanDigest, kCertificateDigest, kUnusedEntry };

  Kind kind;
  std::string field;               ///< "plan_digest", "certificate_digest", "slice_lower[40][3]", ...
  std::string expected, found;     ///< The required and the actual value.
  int step = -1, coordinate = -1;  ///< kUnusedEntry: the first one, in the order of the message.
  double value = 0;                ///< kUnusedEntry: its value.
};

/** All violations, at most one of each kind, in the order of kinds. Empty if the seal holds. Call it before any use of
a certified plan. Cost: two digests, and a test of every entry of slices and errors. */
[[nodiscard]] std::vector<SealFault> FindSealFaults(const certified_plan_t& certified);

}  // namespace forereach
