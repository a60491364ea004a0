#include <iostream>

#include "bus/bus_options.h"
#include "bus/process.h"
#include "certifier/gate/obstacle_sender.h"
#include "certifier/process/certifier_node.h"
#include "cli/commands.h"
#include "cli/offline.h"
#include "logger/logger_node.h"
#include "planner_bridge/planner_node.h"
#include "robot/sim_node.h"

namespace forereach {
namespace {

constexpr std::int64_t kClockStepUs = 1000;

struct Options {
  std::string config, directory, key, obstacles;
};

void Deliver(Bus& bus) {
  while (bus.Dispatch(0) > 0) {
  }
}

// All four nodes in this thread. Time is simulated and does not advance during computations, so the run is the same on
// every machine.
int Run(const Options& options) {
  Config config = LoadConfig(options.config);
  if (!options.directory.empty()) config.logger.directory = options.directory;
  if (!options.key.empty()) config.bus.key = options.key;
  config.bus.keys = AllKeysOf(config.bus);
  config.bus.url = "memq://";
  std::int64_t now = WallClockUs();
  const Clock clock = [&now] { return now; };
  const auto bus = OpenBusOfAllRoles(config.bus, clock);
  LoggerNode logger(config, *bus, std::cout);
  CertifierNode certifier(config, *bus, {clock, clock});
  PlannerNode planner(config, *bus);
  RobotSimNode robot(config, *bus);
  ObstacleSender perception(ObstacleSender::PeriodUs(config.gate));  // this bus has no other sender
  const bool perceives = config.gate.obstacles == ObstaclesSource::kBus;
  const Config world = options.obstacles.empty() ? config : LoadConfig(options.obstacles, TransitionsFile::kIgnore);
  if (perceives) RequireSendable(world);
  const std::vector<Obstacle> perceived = BegunAt(now, world.obstacles);
  certifier.Tick(now);  // as a process does before it hears anything
  Deliver(*bus);
  const auto last = now + static_cast<std::int64_t>((config.robot.time_limit_s + 60) * 1e6);
  for (; !robot.done() && now < last; now += kClockStepUs) {
    if (perceives) perception.Set(SeenBy(now, perceived));
    if (const auto seen = perception.Due(now)) static_cast<void>(bus->Publish(config.bus.obstacles, *seen));
    for (Node* node : std::initializer_list<Node*>{&robot, &planner, &certifier, &logger}) {
      node->Tick(now);
      Deliver(*bus);
    }
  }
  for (Node* node : std::initializer_list<Node*>{&planner, &certifier, &robot, &logger}) node->Stop();
  return 0;
}

}  // namespace

Command RunCommand() {
  const auto options = std::make_shared<Options>();
  return {
      .name = kRun.name,
      .purpose = kRun.purpose,
      .footer = "Example:\n  forereach run --config config/demo.yaml --directory run/log",
      .options = {ConfigOption(options->config),
                  {"--directory", &options->directory, "DIR", "The logger's directory"},
                  {"--obstacles", &options->obstacles, "FILE",
                   "Task file whose obstacles are sent on OBSTACLES, as `forereach obstacles` does, if the task has "
                   "gate.obstacles: bus; by default the same task file"},
                  {"--key", &options->key, "DIR", "Directory of keys; by default the task file's bus.key"}},
      .run = [options] { return Run(*options); }};
}

}  // namespace forereach
