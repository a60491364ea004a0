/** A bad network: passes messages between two buses, and drops, repeats, delays, swaps or corrupts some of them. */
#pragma once

#include <deque>
#include <memory>
#include <random>
#include <set>
#include <string>

#include "bus/bus.h"

namespace forereach {

struct Weather {
  double drop = 0, repeat = 0, delay = 0, swap = 0, corrupt = 0;  ///< Parts of the messages, 0 to 1.
  int delay_ms = 60;
};

class Relay final {
 public:
  /** @param there channels passed from `from` to `to`; all others go back. */
  Relay(const std::string& from, const std::string& to, std::set<std::string> there, unsigned seed);

  void SetWeather(const Weather& weather) { weather_ = weather; }
  /** To be called often. */
  void Pass();
  [[nodiscard]] std::int64_t spoiled() const { return spoiled_; }

 private:
  struct Late {
    Bus* to;
    std::string channel;
    std::vector<std::uint8_t> bytes;
    std::int64_t due_us;
  };
  void Take(Bus& to, const Received& received);
  [[nodiscard]] bool Happens(double part) { return std::uniform_real_distribution<double>(0, 1)(random_) < part; }

  std::unique_ptr<Bus> from_, to_;
  const std::set<std::string> there_;
  Weather weather_;
  std::mt19937 random_;
  std::deque<Late> late_;
  std::int64_t spoiled_ = 0;
};

}  // namespace forereach
