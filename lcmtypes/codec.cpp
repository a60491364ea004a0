#include "lcmtypes/codec.h"

#include <sodium.h>

namespace forereach {

Digest DigestOf(Bytes bytes) {
  // Lets libsodium select the code for this processor, which takes two thirds of the time. Digests are the same without
  // it.
  [[maybe_unused]] static const int initialised = sodium_init();
  Digest digest;
  crypto_generichash(digest.data(), digest.size(), bytes.data(), bytes.size(), nullptr, 0);
  return digest;
}

Digest DigestOf(std::string_view text) {
  return DigestOf(Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

Digest ChainedDigest(const Digest& before, Bytes bytes) {
  std::vector<std::uint8_t> chained(before.begin(), before.end());
  chained.insert(chained.end(), bytes.begin(), bytes.end());
  return DigestOf(chained);
}

std::string ToHex(const Digest& digest) {
  std::string hex(2 * digest.size() + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), digest.data(), digest.size());
  hex.pop_back();
  return hex;
}

}  // namespace forereach
