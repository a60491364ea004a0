#include "lcmtypes/seal.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <cstring>
#include <optional>
#include <type_traits>
#include <utility>

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

// The first entry from `begin` on that is not all zero bits.
std::optional<SealFault> FindEntry(const std::string& name, int step, const double (&row)[kStates], int begin) {
  for (int k = begin; k < kStates; ++k) {
    if (std::bit_cast<std::uint64_t>(row[k]) == 0) continue;
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", row[k]);
    return SealFault{SealFault::Kind::kUnusedEntry,
                     name + "[" + std::to_string(k) + "]",
                     "0, because it is not in use",
                     text,
                     step,
                     k,
                     row[k]};
  }
  return std::nullopt;
}

std::optional<SealFault> FindUnusedEntry(const certified_plan_t& certified, InUse in_use) {
  for (const auto& [name, slices] :
       {std::pair{"slice_lower[", &certified.slice_lower}, {"slice_upper[", &certified.slice_upper}})
    for (int t = 0; t < kSlices; ++t)
      if (auto found =
              FindEntry(name + std::to_string(t) + "]", t, (*slices)[t], t < in_use.slices ? in_use.states : 0))
        return found;
  return FindEntry("state_error", -1, certified.state_error, in_use.states);
}

}  // namespace

Digest PlanDigest(Bytes candidate) {
  const auto number = BigEndian(std::uint64_t{candidate.size()});
  // By blocks as far as they are zero: a byte at a time takes longer than the digest.
  static constexpr std::array<std::uint8_t, 256> kZeros{};
  std::size_t used = candidate.size();
  while (used >= kZeros.size() && std::memcmp(&candidate[used - kZeros.size()], kZeros.data(), kZeros.size()) == 0)
    used -= kZeros.size();
  while (used > 0 && candidate[used - 1] == 0) --used;
  return DigestOf(number, candidate.first(used));
}

Digest CertificateDigest(const certified_plan_t& certified) {
  const InUse in_use = InUseBy(certified.plan);
  std::array<std::uint8_t, sizeof(certified_plan_t)> bytes;  // those in use are set; larger than the bytes of all parts
  std::uint8_t* end = bytes.data();
  const auto append = [&end](const auto& part) { end = std::copy(std::begin(part), std::end(part), end); };
  for (const std::int64_t number :
       {certified_plan_t::getHash(), certified.utime, certified.sequence, certified.expires_utime})
    append(BigEndian(number));
  for (const Slices* slices : {&certified.slice_lower, &certified.slice_upper})
    for (int t = 0; t < in_use.slices; ++t)
      for (int k = 0; k < in_use.states; ++k) append(BigEndian(std::bit_cast<std::uint64_t>((*slices)[t][k])));
  for (int k = 0; k < in_use.states; ++k) append(BigEndian(std::bit_cast<std::uint64_t>(certified.state_error[k])));
  append(BigEndian(certified.step_error_us));
  append(certified.plan_digest);
  append(certified.config_digest);
  append(certified.model_digest);
  append(certified.declaration_digest);
  append(certified.observations_digest);
  append(certified.obstacles_digest);
  append(certified.transitions_digest);
  return DigestOf(Bytes(bytes.data(), end));
}

std::vector<SealFault> FindSealFaults(const certified_plan_t& certified) {
  std::vector<SealFault> faults;
  const auto hold = [&](SealFault::Kind kind, const char* field, const Digest& expected, const Digest& found) {
    if (expected != found) faults.push_back({kind, field, ToHex(expected), ToHex(found)});
  };
  hold(SealFault::Kind::kPlanDigest, "plan_digest", PlanDigest(certified.plan), GetDigest(certified.plan_digest));
  hold(SealFault::Kind::kCertificateDigest, "certificate_digest", CertificateDigest(certified),
       GetDigest(certified.certificate_digest));
  if (auto unused = FindUnusedEntry(certified, InUseBy(certified.plan))) faults.push_back(*std::move(unused));
  return faults;
}

}  // namespace forereach
