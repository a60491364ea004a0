#include "tests/process/raw_datagrams.h"

#include <algorithm>
#include <cerrno>
#include <concepts>
#include <system_error>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bus/bus_url.h"
#include "bus/datagram.h"

namespace forereach {
namespace {

constexpr std::uint32_t kHuge = std::uint32_t{1} << 28;

template <std::integral Integer>
void Append(RawDatagram& datagram, Integer value) {
  for (const std::uint8_t byte : BigEndian(value)) datagram.push_back(byte);
}

void Append(RawDatagram& datagram, std::string_view text) {
  for (const char c : text) datagram.push_back(static_cast<std::uint8_t>(c));
}

RawDatagram NamedThen(std::string_view channel, std::size_t payload_bytes) {
  RawDatagram bytes;
  Append(bytes, channel);
  bytes.resize(channel.size() + 1 + payload_bytes);
  return bytes;
}

std::size_t Below(std::mt19937& random, std::size_t bound) { return random() % bound; }

}  // namespace

RawSender::RawSender(const std::string& url) : handle_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  if (handle_ < 0) throw std::system_error(errno, std::generic_category(), "socket");
  const MulticastUrl place = ParseMulticastUrl(url);
  group_.sin_family = AF_INET;
  group_.sin_port = htons(place.port);
  ::inet_pton(AF_INET, place.group.c_str(), &group_.sin_addr);
  constexpr unsigned char kThisMachine = 0;
  ::setsockopt(handle_, IPPROTO_IP, IP_MULTICAST_TTL, &kThisMachine, sizeof kThisMachine);
}

RawSender::~RawSender() { ::close(handle_); }

bool RawSender::Send(Bytes datagram) const {
  return ::sendto(handle_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&group_),
                  sizeof group_) == static_cast<ssize_t>(datagram.size());
}

bool RawSender::Send(const std::vector<RawDatagram>& datagrams) const {
  return std::ranges::all_of(datagrams, [this](const RawDatagram& datagram) { return Send(Bytes(datagram)); });
}

bool RawSender::SendToHost(Bytes datagram) const {
  sockaddr_in host = group_;
  host.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return ::sendto(handle_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&host),
                  sizeof host) == static_cast<ssize_t>(datagram.size());
}

RawDatagram ShortMessage(std::string_view channel, Bytes payload, std::uint32_t sequence) {
  RawDatagram datagram;
  Append(datagram, "LC02");
  Append(datagram, sequence);
  Append(datagram, channel);
  datagram.push_back(0);
  datagram.insert(datagram.end(), payload.begin(), payload.end());
  return datagram;
}

RawDatagram Fragment(const FragmentClaims& claims, Bytes rest) {
  RawDatagram datagram;
  Append(datagram, "LC03");
  for (const std::uint32_t number : {claims.sequence, claims.message_bytes, claims.offset}) Append(datagram, number);
  for (const std::uint16_t number : {claims.number, claims.fragments}) Append(datagram, number);
  datagram.insert(datagram.end(), rest.begin(), rest.end());
  return datagram;
}

std::vector<RawDatagram> WrappingFragment(std::string_view channel) {
  return {Fragment({.sequence = 1, .message_bytes = 1000, .offset = 0xffff'ff00}, NamedThen(channel, 512))};
}

std::vector<RawDatagram> EndlessNames() {
  std::vector<RawDatagram> datagrams;
  for (const std::size_t bytes : {std::size_t{1}, kMaxChannelBytes, kMaxChannelBytes + 1, std::size_t{5000},
                                  kMaxDatagramBytes - kDatagramHeaderBytes}) {
    datagrams.push_back(ShortMessage(std::string(bytes, 'A'), {}));
    datagrams.back().pop_back();  // the zero byte
    RawDatagram rest(std::min<std::size_t>(bytes, 65'000), 'A');
    datagrams.push_back(Fragment({.sequence = static_cast<std::uint32_t>(bytes), .message_bytes = 2000}, rest));
  }
  return datagrams;
}

std::vector<RawDatagram> HugeClaims(std::string_view channel) {
  std::vector<RawDatagram> datagrams;
  for (std::uint32_t i = 0; i < 20; ++i)
    datagrams.push_back(Fragment({.sequence = i, .message_bytes = kHuge, .fragments = 5000}, NamedThen(channel, 100)));
  return datagrams;
}

RawDatagram RandomFragment(std::mt19937& random, std::string_view channel) {
  const auto any = [&random] { return static_cast<std::uint32_t>(random() >> Below(random, 32)); };
  const auto small = [&any] { return static_cast<std::uint16_t>(any()); };
  const FragmentClaims claims{any(), any(), any(), small(), small()};
  RawDatagram rest = claims.number == 0 ? NamedThen(channel, Below(random, 600)) : RandomBytes(random, 600);
  return Fragment(claims, rest);
}

RawDatagram RandomBytes(std::mt19937& random, std::size_t at_most) {
  RawDatagram bytes(Below(random, at_most + 1));
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

RawDatagram Mutated(std::mt19937& random, RawDatagram datagram) {
  for (std::size_t changes = 1 + Below(random, 4); changes > 0; --changes) {
    const std::size_t reach = Below(random, 4) == 0 ? datagram.size() : std::min<std::size_t>(datagram.size(), 40);
    switch (datagram.empty() ? 2 : Below(random, 4)) {
      case 0: datagram[Below(random, reach)] = static_cast<std::uint8_t>(random()); break;
      case 1: datagram.resize(Below(random, datagram.size() + 1)); break;
      case 2:
        datagram.insert(datagram.begin() + static_cast<std::ptrdiff_t>(datagram.empty() ? 0 : Below(random, reach)),
                        static_cast<std::uint8_t>(random()));
        break;
      default: datagram[Below(random, reach)] = 0; break;
    }
  }
  if (datagram.size() > kMaxDatagramBytes) datagram.resize(kMaxDatagramBytes);
  return datagram;
}

}  // namespace forereach
