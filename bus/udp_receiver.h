/** Receives the datagrams of one multicast group and port, on a thread of its own, and hands on the messages in them.
LCM's own receiver is not used: what it does with a malformed header or a fragment is not under our control. */
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string_view>
#include <thread>

#include "bus/bus_url.h"
#include "bus/datagram.h"

namespace forereach {

class UdpReceiver final {
 public:
  /** Gets each message on the receiving thread, with the time in microseconds since the Unix epoch at which the kernel
  took the datagram. Must not throw. */
  using Deliver = std::function<void(std::string_view channel, Bytes payload, std::int64_t utime)>;

  /** Joins the group by the interface that the machine's routes say, and begins to receive. Unless the URL says how
  large the receive buffer is to be, it asks for `kReceiveBufferBytes`, of which the kernel gives as much as it grants.
  @throws std::system_error naming the step that failed. */
  UdpReceiver(const MulticastUrl& url, Deliver deliver);
  /** Takes up to 50 ms. */
  ~UdpReceiver();
  UdpReceiver(const UdpReceiver&) = delete;
  UdpReceiver& operator=(const UdpReceiver&) = delete;

  /** From any thread. */
  [[nodiscard]] DatagramCounts counts() const;

 private:
  class Socket final {
   public:
    Socket();
    ~Socket();
    Socket(const Socket&) = delete;
    Socket& operator=(const Socket&) = delete;
    [[nodiscard]] int handle() const { return handle_; }

   private:
    int handle_;
  };

  void Open(const MulticastUrl& url);
  void Receive();
  void ReceiveOne(std::uint8_t* buffer, std::size_t bytes);

  const Deliver deliver_;
  const Socket socket_;
  mutable std::mutex mutex_;  // guards counts_
  DatagramCounts counts_;
  std::uint32_t last_lost_ = 0;  // the kernel's count, of the receiving thread
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

/** The receive buffer that a bus asks for: Debian's default, 208 kB, holds four certified plans. */
inline constexpr long kReceiveBufferBytes = long{2} << 20;

/** The largest receive buffer that the kernel grants; 0 if it does not say. */
[[nodiscard]] long GrantedReceiveBufferBytes();

}  // namespace forereach
