#include "tests/faults/flood.h"

#include <array>
#include <chrono>
#include <stdexcept>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bus/bus_url.h"
#include "bus/clock.h"
#include "lcmtypes/codec.h"

namespace forereach {
namespace {

constexpr std::size_t kBatch = 32;

int Opened() {
  const int handle = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const unsigned char ttl = 0;  // stays on this machine
  if (handle < 0 || ::setsockopt(handle, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) != 0)
    throw std::runtime_error("no socket");
  return handle;
}

}  // namespace

ForgedFlood::ForgedFlood(const std::string& url, const std::string& channel,
                         const std::vector<std::vector<std::uint8_t>>& payloads, double rate)
    : socket_(Opened()), url_(url) {
  for (const auto& payload : payloads) {
    std::vector<std::uint8_t>& datagram = datagrams_.emplace_back();
    const auto append = [&](const auto& part) { datagram.insert(datagram.end(), part.begin(), part.end()); };
    append(std::string("LC02"));
    append(BigEndian<std::uint32_t>(0));
    append(channel);
    datagram.push_back(0);
    append(payload);
  }
  thread_ = std::thread([this, rate] { Run(rate); });
}

ForgedFlood::~ForgedFlood() {
  stop_ = true;
  thread_.join();
  ::close(socket_);
}

void ForgedFlood::Run(double rate) {
  const MulticastUrl where = ParseMulticastUrl(url_);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(where.port);
  inet_pton(AF_INET, where.group.c_str(), &address.sin_addr);
  std::array<iovec, kBatch> parts{};
  std::array<mmsghdr, kBatch> messages{};
  std::size_t next = 0;
  const std::int64_t begin = SteadyClockUs();
  while (!stop_) {
    const auto due = static_cast<std::int64_t>(static_cast<double>(SteadyClockUs() - begin) * 1e-6 * rate);
    if (due - sent_ < static_cast<std::int64_t>(kBatch)) {
      std::this_thread::sleep_for(std::chrono::microseconds(50));
      continue;
    }
    for (std::size_t i = 0; i < kBatch; ++i) {
      std::vector<std::uint8_t>& datagram = datagrams_[next++ % datagrams_.size()];
      parts[i] = {datagram.data(), datagram.size()};
      messages[i] = {};
      messages[i].msg_hdr.msg_name = &address;
      messages[i].msg_hdr.msg_namelen = sizeof address;
      messages[i].msg_hdr.msg_iov = &parts[i];
      messages[i].msg_hdr.msg_iovlen = 1;
    }
    if (const int count = ::sendmmsg(socket_, messages.data(), kBatch, 0); count > 0) sent_ += count;
  }
}

}  // namespace forereach
