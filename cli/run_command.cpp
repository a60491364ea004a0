#include <iostream>

#include <fmt/format.h>

#include "bus/process.h"
#include "cli/commands.h"
#include "logger/logger_node.h"
#include "simulator/drive_counts.h"
#include "simulator/lockstep.h"

namespace forereach {
namespace {

struct RunArguments {
  std::string config, directory, key, obstacles;
};

// What became of the planner's work: why a robot may not arrive.
std::string DescribePlanning(const DriveCounts& counts) {
  std::string causes;
  for (const auto* by_cause : {&counts.abstained, &counts.rejected})
    for (const auto& [cause, count] : *by_cause) causes += fmt::format(", {} {}", cause, count);
  return fmt::format(
      "the planner searched {} times and proposed {} plans, {} were certified under the declaration{}; {} steps were "
      "driven",
      counts.searches, counts.proposed, counts.certified, causes, counts.steps);
}

int Run(const RunArguments& options) {
  Config config = LoadConfig(options.config);
  if (!options.directory.empty()) config.logger.directory = options.directory;
  if (!options.key.empty()) config.bus.key = options.key;
  const Config world = options.obstacles.empty() ? config : LoadConfig(options.obstacles, TransitionsFile::kIgnore);
  Lockstep lockstep(config, world, WallClockUs());
  LoggerNode logger(lockstep.config(), lockstep.bus(), std::cout);
  lockstep.Run(&logger);
  lockstep.Stop();
  logger.Stop();
  const DriveCounts counts = CountsOf(lockstep);
  if (counts.goals == 0)
    std::cerr << "forereach: " << options.config
              << ": the robot did not reach planner.goal: " << DescribePlanning(counts) << "; `forereach check "
              << options.config << "` says what may keep it, and `forereach report` what happened\n";
  const auto say = [&](std::int64_t count, const char* what) {
    if (count > 0) std::cerr << "forereach: " << options.config << ": the robot " << what << " (" << count << ")\n";
  };
  say(counts.contacts, "touched obstacles");
  say(counts.limits, "exceeded task.limits");
  say(counts.outside, "left its certified slices: the declaration is false");
  return counts.good() ? 0 : 1;
}

}  // namespace

Command RunCommand() {
  const auto options = std::make_shared<RunArguments>();
  return {.name = "run",
          .footer = "Example:\n  forereach run --config config/demo.yaml --directory run/log",
          .options = {TaskOption(options->config),
                      {"--directory", &options->directory, "DIR", "The logger's directory"},
                      {"--obstacles", &options->obstacles, "FILE",
                       "Task file whose obstacles are sent on OBSTACLES, as `forereach obstacles` does, if the task "
                       "has gate.obstacles: bus; by default the same task file"},
                      {"--key", &options->key, "DIR", "Directory of keys; by default the task file's bus.key"}},
          .run = [options] { return Run(*options); }};
}

}  // namespace forereach
