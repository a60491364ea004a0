#include <iostream>

#include "cli/commands.h"
#include "cli/key_options.h"
#include "cli/offline.h"
#include "records/report.h"

namespace forereach {

Command ReportCommand() {
  const auto options = std::make_shared<ReportOptions>();
  Command command{
      .name = kReport.name,
      .purpose = kReport.purpose,
      .footer = "Example:\n  forereach report run/log/events-20260101-120000-000000.lcmlog --picture run/demo",
      .options = {Required({"logs", &options->logs, "LOG", kLogs}),
                  {"--config", &options->config, "FILE", kTaskOfLogs},
                  {"--picture", &options->picture, "FILE",
                   "Draw obstacles, tubes and driven path into a .svg, .png or .pdf file; without an ending a .svg "
                   "and a .png"},
                  JsonFlag(options->json)},
      .run = [options] {
        Report(*options, std::cout);
        return 0;
      }};
  AddKeyOptions(command.options, options->key);
  return command;
}

}  // namespace forereach
