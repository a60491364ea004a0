/** Receives the datagrams of one multicast group and port on its own thread and delivers the messages in them. It
replaces LCM's receiver, which can crash on a malformed header and allocates the size that a fragment claims. */
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string_view>
#include <thread>

#include "bus/bus_url.h"
#include "bus/datagram.h"
#include "bus/descriptor.h"

namespace forereach {

class UdpReceiver final {
 public:
  /** Called for each message on the receive thread. @param utime when the kernel received the datagram, microseconds
  since the Unix epoch. It must not throw. */
  using Deliver = std::function<void(std::string_view channel, Bytes payload, std::int64_t utime)>;

  /** Joins the group on the interface that the routing table selects and begins to receive. It asks for a receive
  buffer of the size in the URL, or of `kReceiveBufferBytes`; the kernel may grant less.
  @throws std::system_error with the name of the step that failed. */
  UdpReceiver(const MulticastUrl& url, Deliver deliver);
  /** Ends the thread. Takes up to 50 ms. */
  ~UdpReceiver();
  UdpReceiver(const UdpReceiver&) = delete;
  UdpReceiver& operator=(const UdpReceiver&) = delete;

  /** The counts so far. Any thread may call it. */
  [[nodiscard]] DatagramCounts counts() const;

 private:
  void Open(const MulticastUrl& url);
  void Receive();
  void ReceiveOne(std::uint8_t* buffer, std::size_t bytes);

  const Deliver deliver_;
  const Descriptor socket_;
  mutable std::mutex mutex_;  // guards counts_
  DatagramCounts counts_;
  std::uint32_t last_lost_ = 0;  // the kernel's count; used only by the receive thread
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

/** The size of the receive buffer that a bus asks for. Debian's default of 208 kB holds only four certified plans. */
inline constexpr long kReceiveBufferBytes = long{2} << 20;

/** The largest receive buffer that the kernel grants, in bytes; 0 if it is unknown. */
[[nodiscard]] long GrantedReceiveBufferBytes();

}  // namespace forereach
