#include <iostream>

#include "cli/key_options.h"
#include "cli/log_commands.h"
#include "cli/progress.h"
#include "lcmtypes/printable.h"
#include "records/export.h"
#include "records/run_logs.h"

namespace forereach {
namespace {

constexpr std::int64_t kProgressBytes = 1 << 20;

void Describe(const ExportOptions& options, const ExportResult& result) {
  for (const std::string& missing : result.missing) std::cerr << "forereach: " << Printable(missing) << std::endl;
  if (result.damage.places > 0)
    std::cerr << "forereach: damaged in " << result.damage.places << " places, " << result.damage.bytes
              << " bytes; everything else was exported" << std::endl;
  std::cout << "export: ";
  if (options.format == "npz") {
    std::cout << result.tubes << " tubes of certified plans";
  } else if (options.format == "mcap") {
    std::cout << result.messages << " messages";
  } else {
    std::cout << result.decisions << " decisions, " << result.executions << " execution events, " << result.withdrawals
              << " withdrawals, " << result.gaps << " gaps";
    if (result.without_candidate > 0) std::cout << "; the candidates of " << result.without_candidate << " are missing";
  }
  if (result.left_out > 0)
    std::cout << "; " << result.left_out
              << (options.format == "mcap" ? " messages of other types left out" : " with impossible counts left out");
  std::cout << DescribePassedOver(result.passed_over) << "; written to " << options.output << std::endl;
}

int RunExport(const ExportOptions& options) {
  const std::int64_t total = BytesOf(RunsNamedBy(options.inputs));
  ExportResult result;
  {
    Progress progress("MB exported", static_cast<std::size_t>(total / kProgressBytes));
    std::int64_t pending = 0;
    result = Export(options, [&](std::int64_t bytes) {
      for (pending += bytes; pending >= kProgressBytes; pending -= kProgressBytes) progress.Advance();
    });
  }
  Describe(options, result);
  return result.damage.places == 0 && result.missing.empty() ? 0 : 1;
}

}  // namespace

Command ExportCommand() {
  const auto options = std::make_shared<ExportOptions>();
  Command command{
      .name = kExport.name,
      .purpose = kExport.purpose,
      .footer =
          "csv     a directory: decisions.csv, controls.csv, executions.csv, withdrawals.csv, gaps.csv\n"
          "jsonl   the same records, one JSON object a line, in the order of the log\n"
          "npz     the tubes and controls of certified plans as NumPy arrays\n"
          "mcap    every message as JSON with its schema, for PlotJuggler and Foxglove\n\n"
          "Examples:\n  forereach export run/log --format csv -o tables\n"
          "  forereach export run/log/events-20260101-120000-000000.lcmlog --format mcap -o run.mcap",
      .options = {Required({"inputs", &options->inputs, "LOG|DATABASE|DIRECTORY",
                            "Event logs of one run, in their order; or a decision database with its logs beside it, or "
                            "the directory of both"}),
                  Required({.name = "--format",
                            .variable = &options->format,
                            .help = "What is written",
                            .one_of = kExportFormats}),
                  Required({"-o,--out", &options->output, "FILE|DIR",
                            "A new file, or for csv a directory; files that exist are not changed"}),
                  {"--config", &options->config, "FILE",
                   "The task file of the recording, for its channels and its key; by default the one that the logger "
                   "kept next to the log, in tasks/, otherwise the usual channels"}},
      .run = [options] { return RunExport(*options); }};
  AddKeyOptions(command.options, options->key);
  return command;
}

}  // namespace forereach
