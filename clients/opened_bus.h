/** A bus that a client has opened for itself, with its task. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "bus/bus.h"
#include "clients/client_options.h"
#include "task/config.h"

namespace forereach {

/** Calls its argument, which waits for messages and hands them out, for at most 50 ms. Python lets go of its lock
around it. */
using AroundWaiting = std::function<void(const std::function<void()>& wait)>;

/** The bus of a task under one role. Only the thread that opened it may use it. */
class OpenedBus final {
 public:
  /** @param around empty: only waits. @throws BusError, KeyError. */
  OpenedBus(Config task, Role role, const ClientOptions& instead, AroundWaiting around = {});
  /** Reads the task, and warns if it has no key (kUnsignedWarning). @throws ConfigError, BusError, KeyError. */
  OpenedBus(const ClientOptions& options, Role role);

  /** The task with the bus's options and keys. */
  [[nodiscard]] const Config& config() const { return config_; }
  /** @throws std::runtime_error in another thread. */
  [[nodiscard]] Bus& bus() const;
  /** @throws std::runtime_error if the bus does not take the message. */
  void Send(const std::string& channel, Bytes message) const;

  /** Calls handlers until `done` or until this time, microseconds since the Unix epoch. */
  void Listen(std::int64_t until_utime, const std::function<bool()>& done) const;

 private:
  Config config_;
  std::unique_ptr<Bus> bus_;
  AroundWaiting around_;
  const std::thread::id owner_ = std::this_thread::get_id();
};

}  // namespace forereach
