#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "fleet/transitions.h"
#include "lcmtypes/printable.h"
#include "task/config.h"
#include "task/date.h"
#include "task/json_text.h"

namespace forereach {
namespace {

struct FleetImportArguments {
  std::string config, database, day, by = "robot", out;
  Store::WhichTransitions which;
  bool json = false;
};

// The times of a day, UTC.
void SetDay(const std::string& text, Store::WhichTransitions& which) {
  const auto begin = text.size() == 10 ? SecondsOfDate(text + "T00:00:00") : std::nullopt;
  if (!begin) throw ConfigError("--day: {} is no day, for example 2026-01-31", Printable(text));
  which.from = static_cast<std::int64_t>(*begin) * 1'000'000;
  which.until = which.from + std::int64_t{86'400'000'000};
}

FleetTransitions Read(const FleetImportArguments& options, const Config& task) try {
  Store store(options.database);
  return ReadTransitions(store, task, options.which, options.by == "day" ? TransitionsBy::kDay : TransitionsBy::kRobot);
} catch (const std::invalid_argument& error) {  // a task that no certifier accepts
  throw ConfigError("{}: {}", task.path, error.what());
}

int ImportFromFleet(FleetImportArguments options) {
  if (!options.day.empty()) SetDay(options.day, options.which);
  const Config task = LoadConfig(options.config, TransitionsFile::kIgnore);
  const FleetTransitions found = Read(options, task);
  const int count = found.transitions.size();
  const bool is_written = !options.out.empty() && count > 0;
  if (is_written) SaveTransitions(options.out, *task.problem->model, found.transitions);
  const std::vector<FleetTable> tables{found.residuals, found.refused, found.contradictions};
  if (options.json) {
    std::cout << JsonText(ToJson(tables)) << std::endl;
  } else {
    std::cout << ToText(tables) << "import: " << count << " transitions of " << task.period << " s"
              << (is_written ? fmt::format(" in {}", Printable(options.out)) : "");
    if (count > 0)
      std::cout << fmt::format("\nSteps lasted up to {:g} s longer or shorter: {}", found.longer,
                               !found.transitions.longer.isZero(0)
                                   ? "column dt_error says it of each, so it counts"
                                   : "declaration.noise_bound has to include how far states move in that "
                                     "time, or give robot.step_error_ms");
    std::cout << std::endl;
  }
  return count > 0 && found.contradictions.rows.empty() ? 0 : 1;
}

}  // namespace

Command FleetImportCommand() {
  const auto options = std::make_shared<FleetImportArguments>();
  return {.name = "import",
          .purpose =
              "Make a task's transitions of the steps that all robots have executed, and show what differs between "
              "robots: exit 0, 1 if there are none or they contradict the task's declaration, 2 bad input",
          .footer =
              "The file is for `transitions` of a task: forereach fit and forereach declare --from-data read it.\n\n"
              "Example:\n  forereach import --config task.yaml --database postgresql://fleet.example/forereach "
              "--out fleet.csv",
          .options = {ConfigOption(options->config),
                      Required({"--database", &options->database, "URL", kDatabaseAddress}),
                      {"--robot", &options->which.robot, "NAME", "Of this robot alone"},
                      {"--day", &options->day, "YYYY-MM-DD", "Of this day alone, UTC"},
                      OneOf({"robot", "day"}, {"--by", &options->by, "", "What the table of residuals compares"}),
                      {"-o,--out", &options->out, "FILE.csv", "The transitions"},
                      JsonFlag(options->json)},
          .run = [options] { return ImportFromFleet(*options); }};
}

}  // namespace forereach
