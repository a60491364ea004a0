#include "lcmtypes/seal.h"

#include <bit>
#include <cstdio>
#include <optional>
#include <type_traits>

namespace forereach {
namespace {

using Slices = decltype(certified_plan_t::slice_lower);
constexpr int kSlices = std::extent_v<Slices, 0>, kStates = std::extent_v<Slices, 1>;

// Entries [t][k] with t < slices and k < states.
struct InUse {
  int slices = 0, states = 0;
};

InUse InUseBy(const candidate_plan_t& plan) {
  if (!(1 <= plan.num_steps && plan.num_steps < kSlices && 1 <= plan.num_states && plan.num_states <= kStates))
    return {};
  return {plan.num_steps + 1, plan.num_states};
}

std::optional<SealFault> FindUnusedEntry(const char* name, const Slices& slices, InUse in_use) {
  for (int t = 0; t < kSlices; ++t)
    for (int k = t < in_use.slices ? in_use.states : 0; k < kStates; ++k) {
      const double value = slices[t][k];
      if (std::bit_cast<std::uint64_t>(value) == 0) continue;
      char text[32];
      std::snprintf(text, sizeof text, "%.17g", value);
      const std::string field = std::string(name) + "[" + std::to_string(t) + "][" + std::to_string(k) + "]";
      return SealFault{SealFault::Kind::kUnusedEntry, field, "0, because it is not in use", text, t, k, value};
    }
  return std::nullopt;
}

}  // namespace

Digest CertificateDigest(const certified_plan_t& certified) {
  const InUse in_use = InUseBy(certified.plan);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(EncodedSize<certified_plan_t>());
  const auto append = [&bytes](const auto& part) { bytes.insert(bytes.end(), std::begin(part), std::end(part)); };
  for (const std::int64_t number :
       {certified_plan_t::getHash(), certified.utime, certified.sequence, certified.expires_utime})
    append(BigEndian(number));
  for (const Slices* slices : {&certified.slice_lower, &certified.slice_upper})
    for (int t = 0; t < in_use.slices; ++t)
      for (int k = 0; k < in_use.states; ++k) append(BigEndian(std::bit_cast<std::uint64_t>((*slices)[t][k])));
  append(certified.plan_digest);
  append(certified.config_digest);
  append(certified.model_digest);
  append(certified.declaration_digest);
  append(certified.observations_digest);
  append(certified.obstacles_digest);
  append(certified.transitions_digest);
  return DigestOf(bytes);
}

std::vector<SealFault> FindSealFaults(const certified_plan_t& certified) {
  std::vector<SealFault> faults;
  const auto hold = [&](SealFault::Kind kind, const char* field, const Digest& expected, const Digest& found) {
    if (expected != found) faults.push_back({kind, field, ToHex(expected), ToHex(found)});
  };
  hold(SealFault::Kind::kPlanDigest, "plan_digest", DigestOf(Encode(certified.plan)), GetDigest(certified.plan_digest));
  hold(SealFault::Kind::kCertificateDigest, "certificate_digest", CertificateDigest(certified),
       GetDigest(certified.certificate_digest));
  const InUse in_use = InUseBy(certified.plan);
  auto unused = FindUnusedEntry("slice_lower", certified.slice_lower, in_use);
  if (!unused) unused = FindUnusedEntry("slice_upper", certified.slice_upper, in_use);
  if (unused) faults.push_back(*std::move(unused));
  return faults;
}

}  // namespace forereach
