#include "python/open_bus.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <pybind11/pybind11.h>

#include "bus/process.h"

namespace forereach {
namespace {

constexpr std::int64_t kSignalsUs = 50'000;  // how often Ctrl-C is looked for

Config WithBus(Config task, Role role, const std::string& key, const std::string& url) {
  BusArguments{url, key}.Override(task.bus);
  task.bus = WithKeys(std::move(task.bus), role);
  return task;
}

}  // namespace

OpenedBus::OpenedBus(Config task, Role role, const std::string& key, const std::string& url)
    : config_(WithBus(std::move(task), role, key, url)), bus_(OpenBus(config_.bus, role)) {
  if (!config_.bus.keys && PyErr_WarnEx(PyExc_UserWarning, kUnsignedWarning, 1) < 0)
    throw pybind11::error_already_set();
}

Bus& OpenedBus::bus() const {
  if (std::this_thread::get_id() != owner_)
    throw std::runtime_error("a bus is used by the thread that opened it alone");
  return *bus_;
}

void OpenedBus::Send(const std::string& channel, Bytes message) const {
  if (!bus().Publish(channel, message)) throw std::runtime_error(channel + ": the bus does not take the message");
}

void OpenedBus::Listen(std::int64_t until_utime, const std::function<bool()>& done) const {
  bus().Dispatch(0);
  for (std::int64_t left; !done() && (left = until_utime - WallClockUs()) > 0;) {
    {
      const pybind11::gil_scoped_release release;
      bus_->Dispatch(static_cast<int>((std::min(left, kSignalsUs) + 999) / 1000));
    }
    if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
  }
}

}  // namespace forereach
