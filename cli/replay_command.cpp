#include <iostream>

#include <nlohmann/json.hpp>

#include "certifier/task/json_text.h"
#include "cli/commands.h"
#include "cli/key_options.h"
#include "cli/offline.h"
#include "lcmtypes/printable.h"
#include "records/log_tasks.h"
#include "records/replay.h"

namespace forereach {
namespace {

struct Options {
  std::vector<std::string> logs;
  std::string config, plan_digest;
  LogKey key;
  bool json = false, other_task = false;
};

int RunReplay(const Options& options) {
  std::vector<Config> tasks;
  if (options.other_task) {
    static_cast<void>(SurveyRun(options.logs));
    tasks.push_back(LoadConfig(options.config));
    options.key.Override(tasks, options.config);
  } else {
    tasks = TasksOf(options.logs, options.config, options.key);
  }
  const ReplayResult result = Replay(options.logs, tasks, options.plan_digest);
  if (options.json) {
    std::cout << JsonText({{"candidates", result.candidates},
                           {"agreed", result.agreed},
                           {"withdrawals", result.withdrawals},
                           {"circumstances", result.circumstances},
                           {"corruptions", result.corruptions},
                           {"passed_over", ToJson(result.passed_over)},
                           {"shown", result.shown},
                           {"differences", result.differences}})
              << std::endl;
  } else {
    for (const std::string& line : result.shown) std::cout << Printable(line) << "\n";
    for (const std::string& difference : result.differences) std::cout << Printable(difference) << "\n";
    std::cout << "replay: " << result.candidates << " candidates, " << result.agreed << " decisions agree, "
              << result.differences.size() << " differ";
    if (result.withdrawals > 0) std::cout << ", " << result.withdrawals << " withdrawals agree";
    if (result.circumstances > 0)
      std::cout << ", " << result.circumstances
                << " were refused for what no replay gives again (queue, time, not armed, no obstacles, fault)";
    if (result.corruptions > 0) std::cout << "; the log is damaged in " << result.corruptions << " places";
    std::cout << DescribePassedOver(result.passed_over) << std::endl;
  }
  return result.differences.empty() && result.corruptions == 0 && result.candidates > 0 ? 0 : 1;
}

}  // namespace

Command ReplayCommand() {
  const auto options = std::make_shared<Options>();
  Command command{
      .name = kReplay.name,
      .purpose = kReplay.purpose,
      .footer =
          "Examples:\n  forereach replay run/log/events-20260101-120000-000000.lcmlog\n"
          "  forereach replay run/log/events-20260101-120000-000000.lcmlog --other-task --config "
          "config/demo.yaml",
      .options = {Required({"logs", &options->logs, "LOG", kLogs}),
                  {"--config", &options->config, "FILE", kTaskOfLogs},
                  {.name = "--other-task",
                   .variable = &options->other_task,
                   .help = "Replay it through the gate of another task, given by --config, and show its decisions",
                   .needs = "--config"},
                  {"--plan-digest", &options->plan_digest, "HEX",
                   "Also print what was recorded and what is decided again on the candidates whose digest begins so"},
                  JsonFlag(options->json)},
      .run = [options] { return RunReplay(*options); }};
  AddKeyOptions(command.options, options->key);
  return command;
}

}  // namespace forereach
