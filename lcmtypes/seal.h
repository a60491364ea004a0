/** The seal of a certified plan: what tells a receiver that not one bit of it has changed since it was made.

`certificate_digest` is the BLAKE2b-256 of the message's own bytes, in their order on the bus and big-endian as there,
fingerprint included, without three parts:
- `plan`: `plan_digest` stands for it, the BLAKE2b-256 of its bytes as a candidate_plan_t;
- the slice entries that are not in use: t > plan.num_steps or k >= plan.num_states;
- `certificate_digest` itself.
So the seal holds only if plan_digest is that of the plan, which also fixes what is in use, and the entries not in use
are zero, every bit of them. Where num_steps or num_states is outside its range no slice is in use.

It shows damage and mix-ups. It is no signature: who can write a message can seal it. */
#pragma once

#include <string>
#include <vector>

#include "forereach/certified_plan_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

/** What `certificate_digest` has to be. Cost: a digest of 224 bytes and 16 for each slice and state. */
[[nodiscard]] Digest CertificateDigest(const certified_plan_t& certified);

/** One way in which a seal does not hold. */
struct SealFault {
  enum class Kind { kPlanDigest, kCertificateDigest, kUnusedEntry };

  Kind kind;
  std::string field;               ///< "plan_digest", "certificate_digest", "slice_lower[40][3]", ...
  std::string expected, found;     ///< What it has to be, and what it is.
  int step = -1, coordinate = -1;  ///< kUnusedEntry: the first one, those of slice_lower before those of slice_upper.
  double value = 0;                ///< The same.
};

/** All faults, at most one of each kind, in the order of kinds; none if the seal holds. Whoever acts on a certified
plan asks this first. Cost: two digests and a look at every entry. */
[[nodiscard]] std::vector<SealFault> FindSealFaults(const certified_plan_t& certified);

}  // namespace forereach
