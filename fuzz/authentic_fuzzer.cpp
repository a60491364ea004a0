// Signatures: what a receiver takes is what a signer with the key made for the channel, whole, once, and not from before.
#include <map>
#include <set>

#include "fuzz/fuzz.h"
#include "lcmtypes/authentic.h"

namespace forereach {
namespace {

constexpr Key256 kKey{1, 2, 3}, kOtherKey{4};
constexpr int kBegun = 1'000'000, kMaxSigners = 80;
static_assert(kMaxSigners > Authenticator::kMaxStreams);

}  // namespace

bool Try(Bytes data) {
  FuzzedDataProvider input(data.data(), data.size());
  std::map<int, Signer> signers;  // more than a receiver remembers
  Signer forger(kOtherKey, "0", kBegun);
  Authenticator authenticator(kKey, kBegun);
  std::set<std::vector<std::uint8_t>> made, taken;
  std::vector<std::uint8_t> bytes;
  std::int64_t refused = 0;
  for (int i = 0; i < 2 * kMaxSigners && input.remaining_bytes() > 0; ++i) {
    const std::int64_t now = kBegun + i + 1 + (input.ConsumeBool() ? input.ConsumeIntegralInRange(-kBegun, kBegun) : 0);
    const int who = input.ConsumeIntegralInRange(0, kMaxSigners - 1);
    Signer& signer = signers.try_emplace(who, kKey, std::to_string(who), kBegun).first->second;
    const std::vector<std::uint8_t> message = AnyBytes(input, 80);
    switch (input.ConsumeIntegralInRange(0, 4)) {
      case 0: made.insert(bytes = signer.Sign("COMMAND", message, now)); break;
      case 1: bytes = signer.Sign("OTHER", message, now); break;
      case 2: bytes = forger.Sign("COMMAND", message, now); break;
      case 3: bytes = message; break;
      case 4: Damage(input, bytes); break;  // or once more
    }
    const auto [authenticity, inside] = authenticator.Check("COMMAND", bytes);
    if (authenticity == Authenticity::kAuthentic) {
      Require(made.contains(bytes) && taken.insert(bytes).second);
      Require(inside.data() == bytes.data() && inside.size() + kSignatureBytes == bytes.size());
    } else {
      Require(inside.empty());
      ++refused;
    }
  }
  const Refusals& refusals = authenticator.refusals();
  Require(refusals.unsigned_ones + refusals.forged + refusals.replayed == refused);
  return !taken.empty();
}

}  // namespace forereach
