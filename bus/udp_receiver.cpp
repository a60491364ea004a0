#include "bus/udp_receiver.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>

#include "bus/clock.h"

namespace forereach {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{64} << 10;
static_assert(kBufferBytes > kMaxDatagramBytes);
constexpr suseconds_t kReceivePollUs = 50'000;             // how soon the thread sees that it has to stop
constexpr std::chrono::milliseconds kPauseAfterError{10};  // a persistent error must not cause a busy loop

void Require(bool done, const char* step) {
  if (!done) throw std::system_error(errno, std::generic_category(), step);
}

template <class Value>
void SetOption(int socket, int level, int option, const Value& value, const char* step) {
  Require(::setsockopt(socket, level, option, &value, sizeof value) == 0, step);
}

template <class Value>
bool Take(const cmsghdr& part, int type, Value& value) {
  if (part.cmsg_level != SOL_SOCKET || part.cmsg_type != type || part.cmsg_len < CMSG_LEN(sizeof value)) return false;
  std::memcpy(&value, CMSG_DATA(&part), sizeof value);
  return true;
}

}  // namespace

long GrantedReceiveBufferBytes() {
  long bytes = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> bytes;
  return bytes;
}

UdpReceiver::UdpReceiver(const MulticastUrl& url, Deliver deliver)
    : deliver_(std::move(deliver)), socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  Open(url);
  thread_ = std::thread([this] { Receive(); });
}

UdpReceiver::~UdpReceiver() {
  stopping_ = true;
  thread_.join();
}

DatagramCounts UdpReceiver::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void UdpReceiver::Open(const MulticastUrl& url) {
  const int socket = socket_.get();
  Require(socket >= 0, "socket");
  constexpr int kOn = 1, kOff = 0;
  SetOption(socket, SOL_SOCKET, SO_REUSEADDR, kOn, "sharing the port");  // with LCM's processes on this machine
  const long buffer = url.receive_buffer_bytes > 0 ? url.receive_buffer_bytes : kReceiveBufferBytes;
  SetOption(socket, SOL_SOCKET, SO_RCVBUF, static_cast<int>(buffer), "receive buffer");
  SetOption(socket, SOL_SOCKET, SO_TIMESTAMP, kOn, "time stamps");
  SetOption(socket, SOL_SOCKET, SO_RXQ_OVFL, kOn, "count of lost datagrams");
  SetOption(socket, SOL_SOCKET, SO_RCVTIMEO, timeval{0, kReceivePollUs}, "receive timeout");
  // Receives only datagrams to this group, from the interface on which it was joined. Datagrams to the machine's own
  // addresses, and to groups that other programs have joined, are not received.
  SetOption(socket, IPPROTO_IP, IP_MULTICAST_ALL, kOff, "own group alone");
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_port = htons(url.port);
  ::inet_pton(AF_INET, url.group.c_str(), &place.sin_addr);
  Require(::bind(socket, reinterpret_cast<const sockaddr*>(&place), sizeof place) == 0, "bind");
  SetOption(socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, ip_mreq{place.sin_addr, {INADDR_ANY}}, "joining the group");
}

void UdpReceiver::Receive() {
  std::vector<std::uint8_t> buffer(kBufferBytes);
  while (!stopping_) ReceiveOne(buffer.data(), buffer.size());
}

void UdpReceiver::ReceiveOne(std::uint8_t* buffer, std::size_t bytes) {
  iovec vector{buffer, bytes};
  alignas(cmsghdr) std::array<std::uint8_t, CMSG_SPACE(sizeof(timeval)) + CMSG_SPACE(sizeof(std::uint32_t))> control;
  msghdr header{};
  header.msg_iov = &vector;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  const ssize_t size = ::recvmsg(socket_.get(), &header, 0);
  if (size < 0) {
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return;
    {
      const std::lock_guard lock(mutex_);
      ++counts_.receive_errors;
    }
    std::this_thread::sleep_for(kPauseAfterError);
    return;
  }
  timeval stamp{};
  std::uint32_t lost = last_lost_;  // since the socket was opened, modulo 2^32
  for (cmsghdr* part = CMSG_FIRSTHDR(&header); part; part = CMSG_NXTHDR(&header, part))
    if (!Take(*part, SCM_TIMESTAMP, stamp)) Take(*part, SO_RXQ_OVFL, lost);
  const bool truncated = (header.msg_flags & MSG_TRUNC) != 0;
  const Datagram datagram = ParseDatagram({buffer, static_cast<std::size_t>(size)});
  {
    const std::lock_guard lock(mutex_);
    counts_.lost_by_kernel += lost - std::exchange(last_lost_, lost);
    if (truncated)
      ++counts_.truncated;
    else
      counts_.Count(datagram.kind);
  }
  if (truncated || datagram.kind != DatagramKind::kMessage) return;
  const std::int64_t utime = std::int64_t{stamp.tv_sec} * 1'000'000 + stamp.tv_usec;
  // The kernel's stamp, at which the datagram arrived: a thread that waits for its turn does not make a message old.
  deliver_(datagram.channel, datagram.payload, stamp.tv_sec > 0 ? utime : WallClockUs());
}

}  // namespace forereach
