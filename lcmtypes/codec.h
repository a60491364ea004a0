/** Bytes to messages and back: the one place where a message is decoded, and where bytes are digested.

A message is accepted only if its fingerprint is the type's own and decoding consumes exactly the bytes received.
Nothing here looks at values; whoever receives a message validates them. Needs no running bus. */
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

#include "certifier/numerics/compilation.h"

namespace forereach {

using Bytes = std::span<const std::uint8_t>;

/** BLAKE2b-256 of some bytes. */
using Digest = std::array<std::uint8_t, 32>;

[[nodiscard]] Digest DigestOf(Bytes bytes);
[[nodiscard]] Digest DigestOf(std::string_view text);
/** Of a digest and some bytes behind it: of data that grows. */
[[nodiscard]] Digest ChainedDigest(const Digest& before, Bytes bytes);
/** Lower-case hexadecimal, 64 characters. */
[[nodiscard]] std::string ToHex(const Digest& digest);

/** As messages, logs and signatures spell numbers. */
template <std::integral Integer>
[[nodiscard]] std::array<std::uint8_t, sizeof(Integer)> BigEndian(Integer value) {
  std::array<std::uint8_t, sizeof(Integer)> bytes;
  for (auto byte = bytes.rbegin(); byte != bytes.rend(); ++byte, value = static_cast<Integer>(value >> 8))
    *byte = static_cast<std::uint8_t>(value);
  return bytes;
}

/** The number that `bytes` begin with; there have to be as many as it has. */
template <std::integral Integer>
[[nodiscard]] Integer FromBigEndian(Bytes bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes.first(sizeof(Integer))) value = value << 8 | byte;
  return static_cast<Integer>(value);
}

enum class DecodeStatus { kOk, kWrongLength, kTrailingBytes, kUnknownFingerprint };

template <class Message>
[[nodiscard]] std::vector<std::uint8_t> Encode(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/** The size of every message of a fixed-size type, fingerprint included. */
template <class Message>
[[nodiscard]] std::size_t EncodedSize() {
  static const auto size = static_cast<std::size_t>(Message{}.getEncodedSize());
  return size;
}

/** Decodes `bytes` into `message`, which is left zero unless the result is kOk. */
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

/** The same for callers that need no reason. */
template <class Message>
[[nodiscard]] std::optional<Message> Decoded(Bytes bytes) {
  Message message;
  if (Decode(bytes, message) != DecodeStatus::kOk) return std::nullopt;
  return message;
}

/** Writes `text` into a fixed field, cut to leave at least one zero, zero-padded. */
template <std::size_t N>
void SetText(std::uint8_t (&field)[N], std::string_view text) {
  std::memset(field, 0, N);
  std::memcpy(field, text.data(), text.size() < N ? text.size() : N - 1);
}

/** Reads a zero-padded field; bytes that are not printable ASCII become '?'. */
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
