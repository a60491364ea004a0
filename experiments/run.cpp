#include "experiments/run.h"

#include <algorithm>
#include <ostream>
#include <set>
#include <stdexcept>

#include "experiments/run_directory.h"

namespace forereach::experiments {
namespace {

const Experiment& ExperimentNamed(const std::string& name) {
  const auto found = std::ranges::find(Experiments(), name, &Experiment::name);
  if (found == Experiments().end()) throw std::invalid_argument("experiment: there is no " + name);
  return *found;
}

// Each once, in the order in which they are first asked for.
std::vector<Cell> CellsOf(const std::vector<const Experiment*>& experiments, const Scope& scope) {
  std::vector<Cell> all;
  std::set<std::string> keys;
  for (const Experiment* experiment : experiments)
    for (Cell& cell : experiment->cells(scope))
      if (keys.insert(cell.key()).second) all.push_back(std::move(cell));
  return all;
}

std::string Preamble(const RunOptions& options) {
  std::string text = "# The paper's figures, done again\n\nMade by `" + options.command +
                     "`: " + std::to_string(options.scope.seeds) + " seeds";
  for (const System* system : Systems())
    text += "; " + system->name + ": " + std::to_string(std::min(options.effort.scenarios, system->scenarios)) +
            " plans a group and seed, " + std::to_string(std::min(options.effort.rollouts, system->rollouts)) +
            " rollouts of the target a plan";
  return text + R"(.

Models, residuals, horizons, the deployed declarations, sample sizes, noise scales and the order of zonotopes are the
paper's. The paper's text does not give the bounds of its scenarios, its data regions, the sizes of its initial sets or
its seeds: **those are ours**. They are in `experiments/scenarios.h`, `experiments/systems.h` and, for learned plans,
`experiments/chunks`. No constant of the certifier was fitted to a figure. Every experiment uses `method: paper`.

A plan is *target-safe* if no rollout from its initial set, corners included, touches the obstacle. *Recall* is the part
of the target-safe plans that get a certificate. A certificate for any other plan is *false*. *Coverage* is the part of
the complete tubes that contain every rollout. With more than one seed, a figure is the mean ± the sample standard
deviation. "Within the seeds' spread" means that the means differ by at most twice their joint standard error.
)";
}

}  // namespace

void RunExperiments(const RunOptions& options, std::ostream& out) {
  std::vector<const Experiment*> experiments;
  for (const std::string& name : options.names) experiments.push_back(&ExperimentNamed(name));
  const RunDirectory directory(options.directory, options.effort);
  const std::vector<Cell> cells = CellsOf(experiments, options.scope);
  const Results results(cells, RunAll(cells, directory, options.threads));

  const std::filesystem::path report_file = options.report.empty() ? directory.path() / "report.md" : options.report;
  const std::filesystem::path pictures = report_file.parent_path() / "figures";
  std::vector<Table> tables;
  std::string report = Preamble(options);
  for (const Experiment* experiment : experiments) {
    const std::vector<Cell> own = experiment->cells(options.scope);
    std::vector<CellResult> of_own;
    for (const Cell& cell : own) of_own.push_back(results.Of(cell));
    if (!own.empty()) WriteFile(directory.path() / (experiment->name + ".csv"), ToCsv(own, of_own));
    for (const Table& table : experiment->tables(options.scope, results)) {
      const std::string text = std::string(1, '\n').append(ToMarkdown(table));
      out << text << std::flush;
      report += text;
      tables.push_back(table);
    }
    if (!experiment->plots) continue;
    for (const Plot& plot : experiment->plots(options.scope, results))
      if (Draw(plot, directory.path() / "plots", pictures))
        report += "\n![" + plot.caption + "](figures/" + plot.name + ".svg)\n\n" + plot.caption + "\n";
  }
  WriteFile(directory.path() / "tables.csv", ToCsv(tables));
  WriteFile(report_file, report);
}

}  // namespace forereach::experiments
