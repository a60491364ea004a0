/** Parses LCM datagrams from untrusted senders: bytes to a channel and a payload, or to a reason for refusal. Only
LCM's short message is accepted:

    "LC02" | sequence (4 bytes) | channel, 1 to 63 printable ASCII characters | zero byte | payload

LCM splits a message that does not fit one datagram into fragments, "LC03". To join fragments, a receiver has to
allocate the size that the sender claims. Every message of ForeReach fits one datagram, so fragments are refused. These
functions do not allocate or throw, except DescribeRefused. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "lcmtypes/codec.h"

namespace forereach {

inline constexpr std::size_t kMaxChannelBytes = 63;      ///< LCM's limit.
inline constexpr std::size_t kDatagramHeaderBytes = 8;   ///< Magic and sequence.
inline constexpr std::size_t kMaxDatagramBytes = 65507;  ///< The limit of UDP over IPv4.

/** Kinds of datagrams. All but kMessage are refusals; zero is a refusal. */
enum class DatagramKind {
  kTooShort,          ///< Shorter than the header.
  kNotLcm,            ///< Neither of LCM's magic numbers.
  kFragment,          ///< A part of a larger message.
  kUnterminatedName,  ///< No zero byte within the 64 bytes after the header.
  kBadName,           ///< The channel's name is empty or not printable.
  kMessage,
};

struct Datagram {
  DatagramKind kind = DatagramKind::kTooShort;
  std::string_view channel;  ///< For kMessage; refers to the parsed bytes, as does the payload.
  Bytes payload;
};

/** Parses one datagram. Cost O(1) for every length. */
[[nodiscard]] Datagram ParseDatagram(Bytes bytes) noexcept;

/** Whether `name` is 1 to 63 printable ASCII characters. */
[[nodiscard]] bool IsChannelName(std::string_view name) noexcept;

/** Whether LCM sends a payload of this size on a channel name of this length as one short message. */
[[nodiscard]] constexpr bool FitsOneDatagram(std::size_t channel_bytes, std::size_t payload_bytes) {
  constexpr std::size_t kRoom = kMaxDatagramBytes - kDatagramHeaderBytes;
  return channel_bytes <= kMaxChannelBytes && payload_bytes <= kRoom - channel_bytes - 1;
}

/** Numbers of received datagrams by kind, and of losses. */
struct DatagramCounts {
  std::int64_t messages = 0;  ///< Well-formed messages, with or without a subscription.
  std::int64_t too_short = 0, not_lcm = 0, fragments = 0, unterminated_names = 0, bad_names = 0;
  std::int64_t truncated = 0;       ///< Longer than kMaxDatagramBytes.
  std::int64_t lost_by_kernel = 0;  ///< Discarded because the receive buffer was full.
  std::int64_t receive_errors = 0;  ///< Errors of the socket.

  void Count(DatagramKind kind);
  [[nodiscard]] std::int64_t refused() const {
    return too_short + not_lcm + fragments + unterminated_names + bad_names + truncated;
  }
};

/** The refused datagrams as text, for example "3 fragments, 1 without the end of its channel's name". Empty if there
are none. */
[[nodiscard]] std::string DescribeRefused(const DatagramCounts& counts);

}  // namespace forereach
