// Signatures: what a receiver takes is what the channel's role signed for this robot, bus and channel, whole, once, and
// neither from before nor ahead of its clock.
#include <map>
#include <set>

#include "bus/authentic.h"
#include "fuzz/fuzz.h"

namespace forereach {
namespace {

constexpr int kBegun = 1'000'000, kMaxSigners = 300;
static_assert(kMaxSigners > Authenticator::kMaxSenders);

const KeyRing& Keys(const char* robot) {
  static const KeyRing ours = MakeKeyRing("ours", DigestOf("ours")), other = MakeKeyRing("other", DigestOf("other"));
  return robot == std::string("ours") ? ours : other;
}

}  // namespace

bool Try(Bytes data) {
  FuzzedDataProvider input(data.data(), data.size());
  std::map<int, Signer> signers;  // more than a receiver remembers
  Signer forger(Keys("other"), "bus", 0), elsewhere(Keys("ours"), "another bus", 0);
  Authenticator authenticator(Keys("ours"), "bus", {{"COMMAND", Role::kOperator}, {"OTHER", Role::kOperator}}, kBegun);
  std::set<std::vector<std::uint8_t>> made, taken;
  std::vector<std::uint8_t> bytes;
  std::int64_t refused = 0;
  for (int i = 0; i < 2 * kMaxSigners && input.remaining_bytes() > 0; ++i) {
    const std::int64_t now = kBegun + i + 1 + (input.ConsumeBool() ? input.ConsumeIntegralInRange(-kBegun, kBegun) : 0);
    const int who = input.ConsumeIntegralInRange(0, kMaxSigners - 1);
    Signer& signer = signers.try_emplace(who, Keys("ours"), "bus", static_cast<std::uint64_t>(who)).first->second;
    const std::vector<std::uint8_t> message = AnyBytes(input, 80);
    switch (input.ConsumeIntegralInRange(0, 6)) {
      case 0: made.insert(bytes = signer.Sign(Role::kOperator, "COMMAND", message, now)); break;
      case 1: bytes = signer.Sign(Role::kOperator, "OTHER", message, now); break;
      case 2: bytes = forger.Sign(Role::kOperator, "COMMAND", message, now); break;
      case 3: bytes = message; break;
      case 4: Damage(input, bytes); break;  // or once more
      case 5: bytes = signer.Sign(Role::kPlanner, "COMMAND", message, now); break;
      case 6: bytes = elsewhere.Sign(Role::kOperator, "COMMAND", message, now); break;
    }
    const std::int64_t clock =
        kBegun + i + 1 + (input.ConsumeBool() ? input.ConsumeIntegralInRange(-kBegun, kBegun) : 0);
    const auto [authenticity, inside] = authenticator.Check("COMMAND", bytes, clock);
    if (authenticity == Authenticity::kAuthentic) {
      Require(SenderOf(bytes).has_value());
      Require(made.contains(bytes) && taken.insert(bytes).second);
      Require(inside.data() == bytes.data() && inside.size() + kTrailerBytes == bytes.size());
    } else {
      Require(inside.empty());
      ++refused;
    }
  }
  Require(authenticator.refusals().all() == refused);
  return !taken.empty();
}

}  // namespace forereach
