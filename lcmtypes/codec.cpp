#include "lcmtypes/codec.h"

#include <sodium.h>

namespace forereach {

Digest DigestOf(Bytes first, Bytes second) {
  // Lets libsodium select the code for this processor, which takes two thirds of the time. Digests are the same without
  // it.
  [[maybe_unused]] static const int initialised = sodium_init();
  Digest digest;
  crypto_generichash_state state;
  crypto_generichash_init(&state, nullptr, 0, digest.size());
  crypto_generichash_update(&state, first.data(), first.size());
  crypto_generichash_update(&state, second.data(), second.size());
  crypto_generichash_final(&state, digest.data(), digest.size());
  return digest;
}

Digest DigestOf(Bytes bytes) { return DigestOf(bytes, {}); }

Digest DigestOf(std::string_view text) {
  return DigestOf(Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

std::string ToHex(const Digest& digest) {
  std::string hex(2 * digest.size() + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), digest.data(), digest.size());
  hex.pop_back();
  return hex;
}

}  // namespace forereach
