#include <iostream>
#include <memory>
#include <optional>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "fleet/report.h"
#include "records/output_file.h"
#include "task/json_text.h"

namespace forereach {
namespace {

struct FleetReportArguments {
  std::string database, out, runs;
  bool json = false;
};

int ReportFleet(const FleetReportArguments& options) {
  std::optional<OutputFile> page;
  if (!options.out.empty()) page.emplace(options.out);  // before the server works for it
  Store store(options.database);
  const std::vector<FleetTable> tables = ReadFleet(store);
  if (!page) {
    std::cout << (options.json ? JsonText(ToJson(tables)) + "\n" : ToText(tables)) << std::flush;
    return 0;
  }
  page->Write(FleetHtml(tables, options.runs));
  page->Close();
  std::cout << options.out << ": " << tables.front().rows.size() << " robots" << std::endl;
  return 0;
}

}  // namespace

Command FleetReportCommand() {
  const auto options = std::make_shared<FleetReportArguments>();
  return {
      .name = "report",
      .purpose = "Summarise the rows of all robots in the fleet's store: exit 0, 2 if it cannot be read",
      .footer =
          "Example:\n  forereach report --database postgresql://fleet.example/forereach --out fleet.html --runs pages",
      .options = {Required({"--database", &options->database, "URL", kDatabaseAddress}),
                  {"-o,--out", &options->out, "FILE.html", "Write a page for a browser, a new file"},
                  Needing("--out", {"--runs", &options->runs, "URL",
                                    "Where the pages of runs are: numbers lead to URL/ROBOT/LOG.html, as forereach "
                                    "report LOG --out writes them, or to a list of these"}),
                  Excluding("--out", {"--json", &options->json, "", "One JSON document on standard output"})},
      .run = [options] { return ReportFleet(*options); }};
}

}  // namespace forereach
