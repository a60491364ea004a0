#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include <sys/resource.h>

#include "bus/log.h"
#include "bus/node.h"
#include "bus/process.h"
#include "cli/commands.h"
#include "live/web_server.h"
#include "task/config.h"

namespace forereach {
namespace {

constexpr int kUsualPort = 8080;

struct LiveArguments {
  std::string config;
  BusArguments bus;
  std::optional<int> port;
};

// Hears every channel of ForeReach. It is given no way to send.
class LiveNode final : public Node {
 public:
  LiveNode(Bus& bus, const BusOptions& channels, Watcher& watcher) : bus_(bus), watcher_(watcher) {
    for (const auto& [channel, role] : channels.speakers())
      bus.Subscribe(channel, [this](const Received& received) {
        watcher_.Take({number_++, received.utime, received.channel, {received.raw.begin(), received.raw.end()}});
      });
  }

  void Tick(std::int64_t now_us) override {
    const std::int64_t steady_us = SteadyClockUs();
    if (steady_us < next_us_) return;
    next_us_ = steady_us + Watcher::kTickUs;
    watcher_.Tick(now_us, {bus_.dropped(), bus_.datagrams().refused()});
  }

 private:
  const Bus& bus_;
  Watcher& watcher_;
  std::int64_t number_ = 0, next_us_ = 0;
};

std::unique_ptr<WebServer> Serve(const Watcher& watcher, std::optional<int> port) {
  if (port) return std::make_unique<WebServer>(watcher, *port);
  try {
    return std::make_unique<WebServer>(watcher, kUsualPort);
  } catch (const ServerError&) {  // taken
    return std::make_unique<WebServer>(watcher, 0);
  }
}

int RunLive(const LiveArguments& options) {
  const auto load = [&options] {
    Config task = LoadConfig(options.config);
    options.bus.Override(task.bus);
    return task;
  };
  CatchStopSignals();
  SetUpLog("forereach live");
  Config task = load();
  const BusOptions channels = task.bus;
  std::optional<KeyRing> keys = PublicKeysOf(channels);
  if (!keys) logging::Warn(kUnsignedWarning);
  static_cast<void>(setpriority(PRIO_PROCESS, 0, 10));  // a picture is less than a decision
  const std::unique_ptr<Bus> bus = OpenBus(channels.url);
  Watcher watcher(std::move(task), std::move(keys), load);
  LiveNode node(*bus, channels, watcher);
  node.Tick(WallClockUs());
  const std::unique_ptr<WebServer> server = Serve(watcher, options.port);
  std::cout << "http://127.0.0.1:" << server->port() << "/" << std::endl;
  RunNode(node, *bus);
  return 0;
}

}  // namespace

Command LiveCommand() {
  const auto options = std::make_shared<LiveArguments>();
  return {.name = "live",
          .footer =
              "It listens to the bus and sends nothing. The page is for browsers of this machine alone; from another "
              "one, forward its port: ssh -L 8080:127.0.0.1:8080 ROBOT. It prints its address, and ends with Ctrl-C. "
              "See docs/live.md.\n\n"
              "Example:\n  forereach live --config config/demo.yaml --key keys/verify.pub",
          .options = {ConfigOption(options->config, "The task file of the certifier"),
                      {"--lcm-url", &options->bus.url, "URL", "The bus; by default the task file's bus.url"},
                      {"--key", &options->bus.key, "PATH",
                       "verify.pub, a directory of keys or any key file, of which only public keys are read: messages "
                       "that their roles did not sign are counted and not shown; by default the task file's bus.key"},
                      {"--port", &options->port, "",
                       "Port on 127.0.0.1; 0: a free one; by default 8080, or a free one if it is taken",
                       NumberRange{0, 65535}}},
          .run = [options] { return RunLive(*options); }};
}

}  // namespace forereach
