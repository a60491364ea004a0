#include <filesystem>
#include <iostream>
#include <optional>

#include "certifier/task/config_error.h"
#include "cli/commands.h"
#include "cli/key_options.h"
#include "cli/new_file.h"
#include "cli/offline.h"
#include "lcmtypes/printable.h"
#include "page/gather.h"
#include "page/write.h"
#include "records/report.h"

namespace forereach {
namespace {

struct Options {
  ReportOptions report;
  std::string out, before;
  bool force = false;
};

int WritePage(const Options& options) {
  RequireNewFile(options.out, options.force);  // before the logs are read
  const ReportOptions& report = options.report;
  const PageRun run = GatherPage(report.logs, report.config, report.key, {});
  std::optional<PageRun> before;
  if (!options.before.empty()) before = GatherPage({options.before}, report.config, report.key, {0, 0, 0});
  WriteNewFile(options.out, PageHtml(run, before ? &*before : nullptr), options.force);
  std::cout << options.out << ": " << run.decisions.size() << " decisions, " << run.details.size()
            << " with their tube or why there is none\n";
  for (const std::string& note : run.notes) std::cout << Printable(note) << "\n";
  return 0;
}

}  // namespace

Command ReportCommand() {
  const auto options = std::make_shared<Options>();
  ReportOptions& report = options->report;
  Command command{
      .name = kReport.name,
      .purpose = kReport.purpose,
      .footer =
          "With --out it writes a page for a browser: one HTML file that needs no network. See docs/analysis.md.\n\n"
          "Examples:\n  forereach report run/log/events-20260101-120000-000000.lcmlog --picture run/demo\n"
          "  forereach report run/log --out report.html\n"
          "  forereach report run/log --before old/log/decisions.sqlite --out both.html",
      .options = {Required({"logs", &report.logs, "LOG|DATABASE|DIRECTORY",
                            std::string(kLogs) + "; with --out also a decision database, or the directory of both"}),
                  {"--config", &report.config, "FILE", kTaskOfLogs},
                  {.name = "--picture",
                   .variable = &report.picture,
                   .type = "FILE",
                   .help = "Draw obstacles, tubes and driven path into a .svg, .png or .pdf file; without an ending a "
                           ".svg and a .png",
                   .excludes = "--out"},
                  {"-o,--out", &options->out, "FILE.html",
                   "Write a page with figures, every decision and its tube, instead of the text"},
                  {.name = "--before",
                   .variable = &options->before,
                   .type = "LOG|DATABASE|DIRECTORY",
                   .help = "Show its figures beside those of the others on the page",
                   .needs = "--out"},
                  {.name = "--force",
                   .variable = &options->force,
                   .help = "Overwrite the page if it exists",
                   .needs = "--out"},
                  JsonFlag(report.json)},
      .run = [options] {
        if (!options->out.empty()) return WritePage(*options);
        Report(options->report, std::cout);
        return 0;
      }};
  AddKeyOptions(command.options, report.key);
  return command;
}

}  // namespace forereach
