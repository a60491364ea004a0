#include <algorithm>
#include <iostream>

#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "logger/check.h"
#include "logger/json_text.h"

namespace forereach {
namespace {

struct Options {
  std::string directory;
  bool json = false;
};

int RunCheckLog(const Options& options) {
  const std::vector<LogCheck> checks = CheckLogs(options.directory);
  std::cout << (options.json ? JsonText(ToJson(checks)) + "\n" : ToText(checks)) << std::flush;
  return std::ranges::all_of(checks, &LogCheck::whole_log) ? 0 : 1;
}

}  // namespace

void AddCheckLogCommand(CLI::App& app, Action& action) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "check-log",
      "Hold a logger's directory against itself: exit 0 if every event that a row of the database comes from "
      "is in its log unchanged and no log is damaged or unknown to it, else 1; logs deleted for the quota "
      "are no fault");
  command->add_option("directory", options->directory, "The logger's directory")->required()->type_name("DIRECTORY");
  command->add_flag("--json", options->json, "One JSON document on standard output");
  command->footer("Example:\n  forereach check-log run/log");
  command->callback([options, &action] { action = [options] { return RunCheckLog(*options); }; });
}

}  // namespace forereach
