#include "page/columns.h"

#include <algorithm>
#include <array>
#include <bit>
#include <new>
#include <utility>

#include <zlib.h>

namespace forereach {

static_assert(std::endian::native == std::endian::little, "columns are written as they lie in memory");

Digest DigestOfHex(std::string_view hex) {
  const auto value = [](char c) { return '0' <= c && c <= '9' ? c - '0' : 'a' <= c && c <= 'f' ? c - 'a' + 10 : -1; };
  Digest digest{};
  if (hex.size() != kHexDigits || std::ranges::any_of(hex, [&](char c) { return value(c) < 0; })) return digest;
  for (std::size_t i = 0; i < digest.size(); ++i)
    digest[i] = static_cast<std::uint8_t>(value(hex[2 * i]) << 4 | value(hex[2 * i + 1]));
  return digest;
}

std::string Base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(bytes.size() - i, 3);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

struct Packer::Stream : z_stream {};

Packer::Packer() : stream_(std::make_unique<Stream>()) {
  if (deflateInit(stream_.get(), Z_DEFAULT_COMPRESSION) != Z_OK) throw std::bad_alloc();
}

Packer::~Packer() { deflateEnd(stream_.get()); }

void Packer::Deflate(std::string_view bytes, bool is_last) {
  std::array<Bytef, 1 << 15> block;
  stream_->next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream_->avail_in = static_cast<uInt>(bytes.size());
  do {
    stream_->next_out = block.data();
    stream_->avail_out = block.size();
    deflate(stream_.get(), is_last ? Z_FINISH : Z_NO_FLUSH);
    packed_.append(reinterpret_cast<const char*>(block.data()), block.size() - stream_->avail_out);
  } while (stream_->avail_out == 0);
}

nlohmann::json Packer::Finish() {
  Deflate({}, true);
  const std::string text = Base64(std::exchange(packed_, {}));
  return nlohmann::json::binary({text.begin(), text.end()});
}

}  // namespace forereach
