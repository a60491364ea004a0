/** Datagrams as a stranger can send them to a bus: malformed, malicious or at random; and the socket that sends
them. */
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <netinet/in.h>

#include "lcmtypes/codec.h"

namespace forereach {

using RawDatagram = std::vector<std::uint8_t>;

/** A socket of its own that sends to a bus's group and port, on this machine alone. */
class RawSender final {
 public:
  /** @throws std::system_error, BusError. */
  explicit RawSender(const std::string& url);
  ~RawSender();
  RawSender(const RawSender&) = delete;
  RawSender& operator=(const RawSender&) = delete;

  /** Whether the kernel took it. */
  bool Send(Bytes datagram) const;
  bool Send(const std::vector<RawDatagram>& datagrams) const;
  /** To this port of this machine's own address, not to the group. */
  bool SendToHost(Bytes datagram) const;

  [[nodiscard]] int handle() const { return handle_; }

 private:
  int handle_;
  sockaddr_in group_{};
};

/** What LCM sends for a message that fits one datagram. */
[[nodiscard]] RawDatagram ShortMessage(std::string_view channel, Bytes payload, std::uint32_t sequence = 1);

/** A part of a message that does not, with whatever it claims. */
struct FragmentClaims {
  std::uint32_t sequence = 1, message_bytes = 0, offset = 0;
  std::uint16_t number = 0, fragments = 2;
};
/** @param rest what stands behind the header; of fragment 0 it begins with the channel and a zero byte. */
[[nodiscard]] RawDatagram Fragment(const FragmentClaims& claims, Bytes rest);

/** Each of these ended LCM 1.3.1's receiver, or made it take memory, and with it any process on the bus: */
/** one fragment whose offset and size wrap around 2^32 (lcm-proj/lcm#628); */
[[nodiscard]] std::vector<RawDatagram> WrappingFragment(std::string_view channel);
/** short messages and fragments whose channel has no end; */
[[nodiscard]] std::vector<RawDatagram> EndlessNames();
/** twenty first fragments of messages that are said to have 2^28 bytes each; */
[[nodiscard]] std::vector<RawDatagram> HugeClaims(std::string_view channel);
/** a fragment with any claims. */
[[nodiscard]] RawDatagram RandomFragment(std::mt19937& random, std::string_view channel);

/** Up to `at_most` bytes of any kind. */
[[nodiscard]] RawDatagram RandomBytes(std::mt19937& random, std::size_t at_most);
/** A datagram in which some bytes were changed, removed or added; mostly near its head. */
[[nodiscard]] RawDatagram Mutated(std::mt19937& random, RawDatagram datagram);

}  // namespace forereach
