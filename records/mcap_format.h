/** What MCAP files (https://mcap.dev/spec) are made of: a magic, and records of an opcode, a length of 8 bytes and
content. All numbers are little-endian, and texts have their length of 4 bytes before them. */
#pragma once

#include <cstdint>
#include <string_view>

#include <zlib.h>

namespace forereach::mcap {

inline constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/** The checksum of bytes behind others whose checksum is `before`. */
[[nodiscard]] inline std::uint32_t Crc(std::uint32_t before, std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

}  // namespace forereach::mcap
