#include <algorithm>
#include <iostream>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/each_run.h"
#include "records/check.h"
#include "task/json_text.h"

namespace forereach {
namespace {

struct CheckLogArguments {
  std::string directory, config;
  LogKey key;
  bool json = false;
};

int RunCheckLog(const CheckLogArguments& options) {
  const std::vector<LogCheck> checks = CheckLogs(options.directory, options.config, options.key);
  std::cout << (options.json ? JsonText(ToJson(checks)) + "\n" : ToText(checks)) << std::flush;
  return std::ranges::all_of(checks, &LogCheck::whole_log) ? 0 : 1;
}

}  // namespace

Command CheckLogCommand() {
  const auto options = std::make_shared<CheckLogArguments>();
  Command command{.name = "check-log",
                  .footer = "Example:\n  forereach check-log run/log",
                  .options = {Required({"directory", &options->directory, "DIRECTORY", "The logger's directory"}),
                              {"--config", &options->config, "FILE", kTaskOfRecords},
                              JsonFlag(options->json)},
                  .run = [options] { return RunCheckLog(*options); }};
  AddKeyOptions(command.options, options->key);
  return command;
}

}  // namespace forereach
