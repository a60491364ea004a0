/** Somebody who sees obstacles: sends them by a thread of its own, and can fall silent, lose messages and talk
nonsense. */
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "bus/bus.h"
#include "certifier/gate/obstacle_sender.h"

namespace forereach {

class Perception final {
 public:
  Perception(std::unique_ptr<Bus> bus, std::string channel, const GateOptions& options,
             const std::vector<Obstacle>& obstacles)
      : bus_(std::move(bus)), channel_(std::move(channel)), sender_(ObstacleSender::PeriodUs(options)) {
    sender_.Set(obstacles);
    thread_ = std::thread([this] {
      for (; !stop_; std::this_thread::sleep_for(std::chrono::milliseconds(5))) {
        const std::lock_guard lock(mutex_);
        if (silent_) continue;
        if (const auto message = sender_.Due(WallClockUs())) bus_->Publish(channel_, *message);
      }
    });
  }
  ~Perception() {
    stop_ = true;
    thread_.join();
  }
  Perception(const Perception&) = delete;
  Perception& operator=(const Perception&) = delete;

  void SetSilent(bool silent) {
    const std::lock_guard lock(mutex_);
    silent_ = silent;
  }
  /** What is seen from now on. */
  void See(const std::vector<Obstacle>& obstacles) {
    const std::lock_guard lock(mutex_);
    sender_.Set(obstacles);
  }
  /** The next message now, as `spoil` leaves it; true if it was sent. */
  template <class Spoil>
  void SayNow(Spoil spoil) {
    const std::lock_guard lock(mutex_);
    auto message = sender_.Due(--set_back_us_).value();  // due: each time the clock was set back, once more
    message.utime = WallClockUs();
    for (obstacle_t& obstacle : message.obstacle)
      if (obstacle.utime == set_back_us_) obstacle.utime = message.utime;  // it stands
    if (spoil(message)) bus_->Publish(channel_, message);
  }

 private:
  const std::unique_ptr<Bus> bus_;
  const std::string channel_;
  std::mutex mutex_;
  ObstacleSender sender_;
  std::int64_t set_back_us_ = 0;
  bool silent_ = false;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace forereach
