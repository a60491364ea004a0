#include "bus/node.h"

#include <csignal>

namespace forereach {
namespace {

volatile std::sig_atomic_t stop_requested = 0, reload_requested = 0;

void RequestStop(int) { stop_requested = 1; }
void RequestReload(int) { reload_requested = 1; }

}  // namespace

void CatchStopSignals() {
  std::signal(SIGTERM, RequestStop);
  std::signal(SIGINT, RequestStop);
  std::signal(SIGHUP, RequestReload);
}

void RunNode(Node& node, Bus& bus) {
  CatchStopSignals();
  node.Tick(WallClockUs());  // the node sends its first message before it receives any
  while (!stop_requested && !node.done()) {
    bus.Dispatch(node.busy() ? 0 : kTickMs);
    if (reload_requested) {
      reload_requested = 0;
      node.Reload();
    }
    node.Tick(WallClockUs());
  }
  bus.Dispatch(0);
  node.Stop();
}

}  // namespace forereach
