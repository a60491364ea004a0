#include <iostream>
#include <memory>
#include <string>

#include "logger/follower.h"
#include "logger/logger_node.h"
#include "task/process.h"

int main(int argc, char** argv) {
  using namespace forereach;
  std::string directory, database, robot;
  const ProcessDescription description{
      "forereach-logger",
      "Records everything on the bus: an LCM event log (lcm-logplayer plays it) and a database of decisions, execution "
      "events and gaps. Ends on SIGTERM or Ctrl-C with a summary on standard output.",
      "forereach-logger --config config/bicycle.yaml --directory /var/log/forereach", Role::kLogger};
  const auto make_node = [&](const Config& config, Bus& bus) -> std::unique_ptr<Node> {
    Config chosen = config;
    if (!directory.empty()) chosen.logger.directory = directory;
    std::unique_ptr<Node> node;
    try {
      node = std::make_unique<LoggerNode>(chosen, bus, std::cout);
    } catch (const BadInput& error) {
      throw ConfigError("logger.directory: {}", error.what());
    }
    if (!database.empty()) StartFollower(chosen.logger.directory, database, robot);
    return node;
  };
  return RunProcess(
      argc, argv, description, make_node,
      {{"--directory", &directory, "DIR", "The directory of the logs; by default the task file's logger.directory"},
       {"--database", &database, "URL",
        "Also send the rows to the fleet's store, postgresql://[USER@]HOST[:PORT]/DATABASE, in a process beside the "
        "logger, as forereach ingest --follow does"},
       {.name = "--robot",
        .variable = &robot,
        .type = "NAME",
        .help = "Whose rows they are there, without keys",
        .needs = "--database"}});
}
