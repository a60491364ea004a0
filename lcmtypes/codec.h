/** Encoding, decoding and digests of messages. All messages are decoded here.

A message is accepted only if its fingerprint is the type's own and decoding consumes exactly the received bytes. These
functions do not check values; the receiver of a message validates them. They need no running bus. */
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forereach/numerics/compilation.h"

namespace forereach {

using Bytes = std::span<const std::uint8_t>;

/** A BLAKE2b-256 digest. */
using Digest = std::array<std::uint8_t, 32>;

[[nodiscard]] Digest DigestOf(Bytes bytes);
[[nodiscard]] Digest DigestOf(std::string_view text);
/** Of both, one after the other. */
[[nodiscard]] Digest DigestOf(Bytes first, Bytes second);
/** The digest of `before` followed by `bytes`, for data that grows. */
[[nodiscard]] inline Digest ChainedDigest(const Digest& before, Bytes bytes) { return DigestOf(before, bytes); }
/** Lower-case hexadecimal, 64 characters. */
[[nodiscard]] std::string ToHex(const Digest& digest);
inline constexpr std::size_t kHexDigits = 64;  ///< of a digest

/** The bytes of an integer in big-endian order, as in messages, logs and signatures. */
template <std::integral Integer>
[[nodiscard]] std::array<std::uint8_t, sizeof(Integer)> BigEndian(Integer value) {
  std::array<std::uint8_t, sizeof(Integer)> bytes;
  for (auto byte = bytes.rbegin(); byte != bytes.rend(); ++byte, value = static_cast<Integer>(value >> 8))
    *byte = static_cast<std::uint8_t>(value);
  return bytes;
}

/** The big-endian integer at the beginning of `bytes`. @pre bytes.size() >= sizeof(Integer). */
template <std::integral Integer>
[[nodiscard]] Integer FromBigEndian(Bytes bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes.first(sizeof(Integer))) value = value << 8 | byte;
  return static_cast<Integer>(value);
}

enum class DecodeStatus { kOk, kWrongLength, kTrailingBytes, kUnknownFingerprint };

/** The bytes of a message as they are on the bus, fingerprint included. */
template <class Message>
[[nodiscard]] std::vector<std::uint8_t> Encode(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/** The size in bytes of a message of a fixed-size type, fingerprint included. */
template <class Message>
[[nodiscard]] std::size_t EncodedSize() {
  static const auto size = static_cast<std::size_t>(Message{}.getEncodedSize());
  return size;
}

/** Decodes `bytes` into `message`. Unless the result is kOk, `message` is zero. Cost: linear in the size of the
type. */
template <class Message>
[[nodiscard]] DecodeStatus Decode(Bytes bytes, Message& message) {
  message = Message{};
  if (bytes.size() < 8) return DecodeStatus::kWrongLength;
  if (FromBigEndian<std::int64_t>(bytes) != Message::getHash()) return DecodeStatus::kUnknownFingerprint;
  const std::size_t size = EncodedSize<Message>();
  if (bytes.size() < size) return DecodeStatus::kWrongLength;
  if (bytes.size() > size) return DecodeStatus::kTrailingBytes;
  if (message.decode(bytes.data(), 0, static_cast<int>(size)) != static_cast<int>(size)) {
    message = Message{};
    return DecodeStatus::kWrongLength;
  }
  return DecodeStatus::kOk;
}

/** The decoded message, or nothing if `bytes` are not a message of this type. */
template <class Message>
[[nodiscard]] std::optional<Message> Decoded(Bytes bytes) {
  Message message;
  if (Decode(bytes, message) != DecodeStatus::kOk) return std::nullopt;
  return message;
}

/** Writes `text` into a fixed field, truncated so that at least one zero follows, and pads with zeros. */
template <std::size_t N>
void SetText(std::uint8_t (&field)[N], std::string_view text) {
  std::memset(field, 0, N);
  std::memcpy(field, text.data(), text.size() < N ? text.size() : N - 1);
}

/** Reads a zero-padded field. Bytes that are not printable ASCII become '?'. */
template <std::size_t N>
[[nodiscard]] std::string GetText(const std::uint8_t (&field)[N]) {
  std::string text;
  for (std::size_t i = 0; i < N && field[i] != 0; ++i)
    text.push_back(field[i] >= 0x20 && field[i] < 0x7f ? static_cast<char>(field[i]) : '?');
  return text;
}

inline void SetDigest(std::uint8_t (&field)[32], const Digest& digest) {
  std::memcpy(field, digest.data(), digest.size());
}

[[nodiscard]] inline Digest GetDigest(const std::uint8_t (&field)[32]) {
  Digest digest;
  std::memcpy(digest.data(), field, digest.size());
  return digest;
}

}  // namespace forereach
