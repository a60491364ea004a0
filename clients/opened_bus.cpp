#include "clients/opened_bus.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <fmt/core.h>

#include "bus/log.h"
#include "bus/process.h"

namespace forereach {
namespace {

constexpr std::int64_t kWaitUs = 50'000;  // how often Python looks for Ctrl-C

Config WithBus(Config task, Role role, const ClientOptions& instead) {
  BusArguments{instead.url, instead.key}.Override(task.bus);
  task.bus = WithKeys(std::move(task.bus), role);
  return task;
}

}  // namespace

OpenedBus::OpenedBus(Config task, Role role, const ClientOptions& instead, AroundWaiting around)
    : config_(WithBus(std::move(task), role, instead)),
      bus_(OpenBus(config_.bus, role)),
      around_(around ? std::move(around) : [](const auto& wait) { wait(); }) {}

OpenedBus::OpenedBus(const ClientOptions& options, Role role) : OpenedBus(LoadConfig(options.task), role, options) {
  if (!config_.bus.keys) logging::Warn(kUnsignedWarning);
}

Bus& OpenedBus::bus() const {
  if (std::this_thread::get_id() != owner_)
    throw std::runtime_error("a bus is used by the thread that opened it alone");
  return *bus_;
}

void OpenedBus::Send(const std::string& channel, Bytes message) const {
  if (!bus().Publish(channel, message))
    throw std::runtime_error(fmt::format("{}: the bus does not take the message", channel));
}

void OpenedBus::Listen(std::int64_t until_utime, const std::function<bool()>& done) const {
  // What has come by now is handed out also if there is no time to wait.
  bus().Dispatch(0);
  for (std::int64_t left; !done() && (left = until_utime - WallClockUs()) > 0;)
    around_([&] { bus_->Dispatch(static_cast<int>((std::min(left, kWaitUs) + 999) / 1000)); });
}

}  // namespace forereach
