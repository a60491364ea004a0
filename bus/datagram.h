/** LCM's datagrams, as anybody on the network can send them: bytes to a channel and a payload, or the reason for
refusing them. One kind is read, LCM's short message:

    "LC02" | sequence (4 bytes) | channel, 1 to 63 printable ASCII characters | zero byte | payload

LCM splits a message that does not fit one datagram into fragments, "LC03". To put fragments together a receiver keeps
memory for a message of which it knows the sender's claims only. Every message of ours fits one datagram, so fragments
are refused. Nothing here allocates or throws. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "lcmtypes/codec.h"

namespace forereach {

inline constexpr std::size_t kMaxChannelBytes = 63;      ///< LCM's limit.
inline constexpr std::size_t kDatagramHeaderBytes = 8;   ///< Magic and sequence.
inline constexpr std::size_t kMaxDatagramBytes = 65507;  ///< What UDP over IPv4 carries.

/** Zero is a refusal. */
enum class DatagramKind {
  kTooShort,          ///< Shorter than the header.
  kNotLcm,            ///< Neither magic.
  kFragment,          ///< A part of a larger message.
  kUnterminatedName,  ///< No zero byte among the 64 bytes behind the header, or in what there is of them.
  kBadName,           ///< The channel's name is empty or not printable.
  kMessage,
};

struct Datagram {
  DatagramKind kind = DatagramKind::kTooShort;
  std::string_view channel;  ///< Of a message; inside the bytes parsed, as is the payload.
  Bytes payload;
};

/** Cost: constant, whatever the length. */
[[nodiscard]] Datagram ParseDatagram(Bytes bytes) noexcept;

/** 1 to 63 printable ASCII characters. */
[[nodiscard]] bool IsChannelName(std::string_view name) noexcept;

/** Whether LCM sends so many bytes on this channel as one short message, which is the only kind that is received. */
[[nodiscard]] constexpr bool FitsOneDatagram(std::size_t channel_bytes, std::size_t payload_bytes) {
  constexpr std::size_t kRoom = kMaxDatagramBytes - kDatagramHeaderBytes;
  return channel_bytes <= kMaxChannelBytes && payload_bytes <= kRoom - channel_bytes - 1;
}

/** Datagrams that arrived at a bus, by what became of them, and what never arrived. */
struct DatagramCounts {
  std::int64_t messages = 0;  ///< Well formed, whether anybody subscribes to the channel or not.
  std::int64_t too_short = 0, not_lcm = 0, fragments = 0, unterminated_names = 0, bad_names = 0;
  std::int64_t truncated = 0;       ///< Longer than any datagram can be.
  std::int64_t lost_by_kernel = 0;  ///< The receive buffer was full.
  std::int64_t receive_errors = 0;  ///< The socket gave an error instead of a datagram.

  void Count(DatagramKind kind);
  [[nodiscard]] std::int64_t refused() const {
    return too_short + not_lcm + fragments + unterminated_names + bad_names + truncated;
  }
};

/** As "3 fragments, 1 without the end of its channel's name"; empty if none was refused. */
[[nodiscard]] std::string RefusedInWords(const DatagramCounts& counts);

}  // namespace forereach
