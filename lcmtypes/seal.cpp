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

// Bytes as on the bus: LCM's own functions encode them.
class BusBytes {
 public:
  explicit BusBytes(std::size_t at_most) { bytes_.reserve(at_most); }

  void Append(std::int64_t value) { __int64_t_encode_array(Grow(sizeof value), 0, sizeof value, &value, 1); }
  void Append(const Slices& slices, InUse in_use) {
    const int size = in_use.states * static_cast<int>(sizeof(double));
    for (int t = 0; t < in_use.slices; ++t)
      __double_encode_array(Grow(static_cast<std::size_t>(size)), 0, size, slices[t], in_use.states);
  }
  void Append(const std::uint8_t (&digest)[32]) { std::memcpy(Grow(sizeof digest), digest, sizeof digest); }

  [[nodiscard]] Digest digest() const { return DigestOf(bytes_); }

 private:
  [[nodiscard]] std::uint8_t* Grow(std::size_t by) {
    bytes_.resize(bytes_.size() + by);
    return bytes_.data() + bytes_.size() - by;
  }

  std::vector<std::uint8_t> bytes_;
};

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
  BusBytes bytes(EncodedSize<certified_plan_t>());
  bytes.Append(certified_plan_t::getHash());
  bytes.Append(certified.utime);
  bytes.Append(certified.sequence);
  bytes.Append(certified.expires_utime);
  bytes.Append(certified.slice_lower, in_use);
  bytes.Append(certified.slice_upper, in_use);
  bytes.Append(certified.plan_digest);
  bytes.Append(certified.config_digest);
  bytes.Append(certified.model_digest);
  bytes.Append(certified.declaration_digest);
  bytes.Append(certified.observations_digest);
  bytes.Append(certified.obstacles_digest);
  return bytes.digest();
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
