#include "bus/node.h"

#include <csignal>

#include <systemd/sd-daemon.h>

namespace forereach {
namespace {

volatile std::sig_atomic_t stop_requested = 0, reload_requested = 0;

void RequestStop(int) { stop_requested = 1; }
void RequestReload(int) { reload_requested = 1; }

// What systemd hears of a service of Type=notify: that it is ready, that its loop still turns, that it ends. Nothing
// where systemd did not start the process.
class Service final {
 public:
  Service() {
    std::uint64_t period_us = 0;
    if (sd_watchdog_enabled(0, &period_us) > 0) period_us_ = static_cast<std::int64_t>(period_us / 4);
    sd_notify(0, "READY=1");
  }

  void SayAlive() {
    if (period_us_ == 0 || SteadyClockUs() < next_us_) return;
    next_us_ = SteadyClockUs() + period_us_;
    sd_notify(0, "WATCHDOG=1");
  }
  void SayStops() { sd_notify(0, "STOPPING=1"); }

 private:
  std::int64_t period_us_ = 0, next_us_ = 0;
};

}  // namespace

void CatchStopSignals() {
  std::signal(SIGTERM, RequestStop);
  std::signal(SIGINT, RequestStop);
  std::signal(SIGHUP, RequestReload);
}

void RunNode(Node& node, Bus& bus) {
  CatchStopSignals();
  node.Tick(WallClockUs());  // the node sends its first message before it receives any
  Service service;
  while (!stop_requested && !node.done()) {
    bus.Dispatch(node.busy() ? 0 : kTickMs);
    if (reload_requested) {
      reload_requested = 0;
      node.Reload();
    }
    node.Tick(WallClockUs());
    service.SayAlive();
  }
  service.SayStops();
  // What has come by now is still answered.
  bus.Dispatch(0);
  node.Stop();
}

}  // namespace forereach
