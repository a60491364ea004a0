#include "lcmtypes/codec.h"

#include <sodium.h>

#include "forereach/certified_plan_t.hpp"

namespace forereach {

Digest DigestOf(Bytes bytes) {
  Digest digest;
  crypto_generichash(digest.data(), digest.size(), bytes.data(), bytes.size(), nullptr, 0);
  return digest;
}

Digest DigestOf(std::string_view text) {
  return DigestOf(Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

std::string ToHex(const Digest& digest) {
  std::string hex(2 * digest.size() + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), digest.data(), digest.size());
  hex.pop_back();
  return hex;
}

Digest CertificateDigest(const certified_plan_t& certified) {
  certified_plan_t blank = certified;
  SetDigest(blank.certificate_digest, Digest{});
  return DigestOf(Encode(blank));
}

}  // namespace forereach
