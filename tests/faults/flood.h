/** A stranger on the network who floods the bus with forged messages, as fast as one thread can send. */
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace forereach {

class ForgedFlood final {
 public:
  /** Sends LCM datagrams that have `payloads` in turn to the bus, `rate` a second, until it is destroyed.
  @throws std::runtime_error if there is no socket. */
  ForgedFlood(const std::string& url, const std::string& channel,
              const std::vector<std::vector<std::uint8_t>>& payloads, double rate);
  ~ForgedFlood();

  [[nodiscard]] std::int64_t sent() const { return sent_; }

 private:
  void Run(double rate);

  const int socket_;
  const std::string url_;
  std::vector<std::vector<std::uint8_t>> datagrams_;
  std::atomic<std::int64_t> sent_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace forereach
