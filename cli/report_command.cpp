#include <iostream>

#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "logger/report.h"

namespace forereach {

void AddReportCommand(CLI::App& app, Action& action) {
  auto options = std::make_shared<ReportOptions>();
  CLI::App* command = app.add_subcommand("report", "Sum up a recorded log, and draw it");
  command->add_option("logs", options->logs, kLogs)->required()->type_name("LOG");
  command->add_option("--config", options->config, kTaskOfLogs)->type_name("FILE");
  command
      ->add_option("--picture", options->picture,
                   "Obstacles, tubes and driven path: a .svg, .png or .pdf file; without an ending a .svg and a .png")
      ->type_name("FILE");
  command->add_flag("--json", options->json, "One JSON document on standard output");
  command->footer(
      "Example:\n  forereach report run/log/events-20260101-120000-000000.lcmlog "
      "--picture run/demo");
  command->callback([options, &action] {
    action = [options] {
      Report(*options, std::cout);
      return 0;
    };
  });
}

}  // namespace forereach
