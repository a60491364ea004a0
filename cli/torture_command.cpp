#include <iostream>
#include <memory>

#include <nlohmann/json.hpp>

#include "bus/process.h"
#include "cli/commands.h"
#include "command_line/progress.h"
#include "task/json_text.h"
#include "torture/torture.h"

namespace forereach {
namespace {

struct TortureArguments {
  std::string config;
  BusArguments bus;
  TortureOptions torture;
  bool json = false;
};

int Run(const TortureArguments& options) {
  Config config = LoadConfig(options.config);
  options.bus.Override(config.bus);
  config.bus = WithKeys(std::move(config.bus), Role::kPlanner);
  Progress progress("attacks", TortureSteps(config));
  const TortureReport report = Torture(config, options.torture, [&] { progress.Advance(); });
  std::cout << (options.json ? JsonText(ToJson(report), 2) + "\n" : ToText(report));
  return report.through() == 0 && report.alive ? 0 : 1;
}

}  // namespace

Command TortureCommand() {
  const auto options = std::make_shared<TortureArguments>();
  Command command{
      .name = "torture",
      .purpose =
          "Send what a hostile or broken planner and sender would to a running gate and guard, and count what gets "
          "through: exit 0 if nothing does, 1 if something, 2 bad input. Not to a robot that is in use",
      .footer =
          "It sends stale, future, doubled, altered, not finite and oversized messages, a flood and a clock that "
          "jumps. With --key, the planner's, it also tries that key, replays and alterations on every other role's "
          "channel. It ends by itself.\n\n"
          "Example:\n  forereach torture --config my_robot.yaml --key keys/planner.key",
      .options = {ConfigOption(options->config, "Task file (YAML) of the gate and the guard"),
                  {"--flood", &options->torture.flood, "N", "Candidates of the flood", NumberRange{1, 100'000}},
                  {"--patience", &options->torture.patience_s, "S", "How long to wait for an answer or a heartbeat",
                   NumberRange{0.5, 60}},
                  {"--beyond-loopback", &options->torture.beyond_loopback, "BUS",
                   "The name of the bus, GROUP:PORT or bus.name: required where its URL leaves this machine"},
                  JsonFlag(options->json)},
      .run = [options] { return Run(*options); }};
  options->bus.AddTo(command.options);
  return command;
}

}  // namespace forereach
