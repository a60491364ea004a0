#include <iostream>

#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "cli/replay.h"
#include "lcmtypes/printable.h"
#include "logger/json_text.h"
#include "logger/log_tasks.h"

namespace forereach {
namespace {

struct Options {
  std::vector<std::string> logs;
  std::string config;
  LogKey key;
  bool json = false, other_task = false;
};

int RunReplay(const Options& options) {
  std::vector<Config> tasks;
  if (options.other_task) {
    static_cast<void>(SurveyRun(options.logs));
    tasks.push_back(LoadConfig(options.config));
  } else {
    tasks = TasksOf(options.logs, options.config);
  }
  options.key.Override(tasks, options.config);
  const ReplayResult result = Replay(options.logs, tasks);
  if (options.json) {
    std::cout << JsonText({{"candidates", result.candidates},
                           {"agreed", result.agreed},
                           {"circumstances", result.circumstances},
                           {"corruptions", result.corruptions},
                           {"passed_over", ToJson(result.passed_over)},
                           {"differences", result.differences}})
              << std::endl;
  } else {
    for (const std::string& difference : result.differences) std::cout << Printable(difference) << "\n";
    std::cout << "replay: " << result.candidates << " candidates, " << result.agreed << " decisions agree, "
              << result.differences.size() << " differ";
    if (result.circumstances > 0)
      std::cout << ", " << result.circumstances
                << " were refused for what no replay gives again (queue, time, not armed, no obstacles, fault)";
    if (result.corruptions > 0) std::cout << "; the log is damaged in " << result.corruptions << " places";
    std::cout << InWords(result.passed_over) << std::endl;
  }
  return result.differences.empty() && result.corruptions == 0 && result.candidates > 0 ? 0 : 1;
}

}  // namespace

void AddReplayCommand(CLI::App& app, Action& action) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "replay", "Put a recorded log through the same gate again: exit 0 if every decision is the recorded one, else 1");
  command->add_option("logs", options->logs, kLogs)->required()->type_name("LOG");
  CLI::Option* config = command->add_option("--config", options->config, kTaskOfLogs);
  config->type_name("FILE");
  command
      ->add_flag("--other-task", options->other_task,
                 "Put it through the gate of another task, the one of --config: what would it have decided?")
      ->needs(config);
  options->key.AddTo(*command);
  command->add_flag("--json", options->json, "One JSON document on standard output");
  command->footer(
      "Examples:\n  forereach replay run/log/events-20260101-120000-000000.lcmlog\n"
      "  forereach replay run/log/events-20260101-120000-000000.lcmlog --other-task --config config/demo.yaml");
  command->callback([options, &action] { action = [options] { return RunReplay(*options); }; });
}

}  // namespace forereach
