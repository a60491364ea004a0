/** What the planner's end and the robot's end of a bus share. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "bus/bus.h"
#include "task/config.h"

namespace forereach {

/** The bus of a task under one role. Only the thread that opened it may use it. */
class OpenedBus final {
 public:
  /** @param key, url in place of the task's, if they are not empty. Without a key it warns (kUnsignedWarning).
  @throws BusError, KeyError. */
  OpenedBus(Config task, Role role, const std::string& key, const std::string& url);

  /** The task with the bus's options and keys. */
  [[nodiscard]] const Config& config() const { return config_; }
  /** @throws std::runtime_error in another thread. */
  [[nodiscard]] Bus& bus() const;
  /** @throws std::runtime_error if the bus does not take the message. */
  void Send(const std::string& channel, Bytes message) const;

  /** Calls handlers until `done` or until this time, microseconds since the Unix epoch, without Python's lock; a
  handler that needs it takes it. Ctrl-C ends it with Python's exception. */
  void Listen(std::int64_t until_utime, const std::function<bool()>& done) const;

 private:
  Config config_;
  std::unique_ptr<Bus> bus_;
  const std::thread::id owner_ = std::this_thread::get_id();
};

}  // namespace forereach
