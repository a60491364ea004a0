#include "research/run.h"

#include <algorithm>
#include <ostream>
#include <set>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "forereach/numerics/size.h"
#include "research/run_directory.h"
#include "task/files.h"
#include "task/json_text.h"

namespace forereach::research {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

const Experiment& ExperimentNamed(const std::string& name) {
  const auto found = std::ranges::find(Experiments(), name, &Experiment::name);
  if (found == Experiments().end()) throw std::invalid_argument("experiment: there is no " + name);
  return *found;
}

std::vector<Cell> CellsOf(const Experiment& experiment, const Scope& scope) {
  return experiment.cells ? experiment.cells(scope) : std::vector<Cell>();
}

// Each once, in the order in which they are first asked for.
std::vector<Cell> CellsOf(const RunOptions& options) {
  std::vector<Cell> all;
  std::set<std::string> keys;
  for (const std::string& name : options.names)
    for (Cell& cell : CellsOf(ExperimentNamed(name), options.scope))
      if (keys.insert(cell.key()).second) all.push_back(std::move(cell));
  return all;
}

std::string Preamble(const RunOptions& options, const std::vector<Table>& tables) {
  std::string text = "# The paper's figures, done again\n\n" + ToMarkdown(options.origin) + "\n" +
                     std::to_string(options.scope.seeds) + " seeds";
  for (const System* system : Systems())
    text += "; " + system->name + ": " + std::to_string(std::min(options.effort.scenarios, system->scenarios)) +
            " plans a group and seed, " + std::to_string(std::min(options.effort.rollouts, system->rollouts)) +
            " rollouts of the target a plan";
  return text + R"(.

## What agreement is worth
Models, residuals, horizons, the deployed declarations, sample sizes, noise scales and the order of zonotopes are the
paper's. Its text does not give the bounds of its scenarios, its data regions, the sizes of its initial sets, where its
obstacles stand, or its seeds. Ours are in `research/scenarios.h`, `research/systems.h` and, for learned plans,
`research/chunks`.

**The definitions of the point mass's and the bicycle's scenarios were fitted.** They were found by a search for
definitions under which these figures of the paper come out: the recall of group C, for the bicycle by N, and the shares
of D and S in group B, of both systems. Agreement with these figures is by construction and confirms nothing. Every row
has a mark:
- *exact*: the paper's text fixes every input, so the figure has to come out to the last digit;
- *taken*: an input of ours, copied from the text;
- *fitted*: one of the figures above, or one that follows from it; the figures of two other methods, regional
  calibration and the plug-in Gaussian, whose reading was chosen by them among those that `readings` tables; and the
  slack of parameter boxes by the paper's grid, by which the parameters in the box were chosen;
- *ours*: it depends on definitions that the paper does not give, and that were not searched for this figure. The
  center of global calibration was chosen in view of what the paper says of it: `research/methods.md`;
- *not given*: the paper prints no value.

Nothing in the certifier was fitted: none of its constants was chosen for a figure. Every experiment uses
`method: paper`.

Beside the mark is a word. *Same*: ours, rounded, has the paper's digits. *Near*: it has not, both spreads over seeds
are known, and the means differ by at most twice the standard error of their difference. *Off*: neither, or there is no
plan to measure ours on; then the last column says why. Were the true means equal, 6 to 8 % of the rows with
both spreads would be off by chance. Each figure of the paper counts once here, with the worst word of its rows; the
spread of a figure that is printed twice is that of either place. Figures that are 0, 1 or a whole number are easily met,
and stand apart.

)" + CountInMarkdown(tables) +
         R"(
A row's word says nothing of its table. Below each table its rows are tested together, three times:
- The sum of the squared differences over their squared standard errors, held against a chi-square law. It takes the rows
  as independent, and the spreads as known, though they are those of ten seeds.
- The least p of a row by Welch's test, times the number of rows (Bonferroni). It holds however the rows depend on each
  other, and for spreads of ten seeds.
- A sign test of the rows on either side of the paper, whether they have a spread or not. It takes the rows as
  independent.

Rows of a table are not independent: they share seeds, plans and, as those of a smaller N are the first of a larger,
observations. So a small p of the first or the last is a warning, not a measure. Rows that other rows of their table
decide are left out. The first two take a mean over seeds as normal, which it is not near 0 and 1. Fitted rows are in:
that they agree confirms nothing, that they do not is worth knowing. Nothing corrects for the number of tables.

## Words
A plan is *target-safe* if no rollout from its initial set, corners included, touches the obstacle. *Recall* is the part
of the target-safe plans that get a certificate. A certificate for any other plan is *false*. *Coverage* is the part of
the complete tubes that contain every rollout. With more than one seed, a figure is the mean ± the sample standard
deviation. In the run directory, tables.csv has Student's 95 % interval of each mean over the seeds, and the CSV file of an
experiment Wilson's of recall and coverage over the plans of each cell.
)";
}

// What a shard is of.
Json JsonOf(const RunOptions& options, int count) {
  return {{"names", options.names},
          {"seeds", options.scope.seeds},
          {"quick", options.scope.quick},
          {"scenarios", options.effort.scenarios},
          {"rollouts", options.effort.rollouts},
          {"command", options.origin.command},
          {"shards", count}};
}

Json ReadJson(const fs::path& file) {
  try {
    return ParseJson<Json>(ReadWhole(file.string(), kLargestJsonFile));
  } catch (const Json::exception& error) {
    throw std::runtime_error(file.string() + ": " + DescribeJsonError(error));
  }
}

fs::path FileOf(const Cell& cell) { return fs::path("cells") / (cell.key() + ".json"); }

}  // namespace

fs::path DefaultDirectory(bool quick) { return quick ? "run/research-quick" : "run/research"; }

void RunShard(const RunOptions& options, int index, int count, const fs::path& file) {
  const std::vector<Cell> all = CellsOf(options);
  std::vector<Cell> own;
  for (std::size_t i = ToSize(index); i < all.size(); i += ToSize(count)) own.push_back(all[i]);
  const RunDirectory directory(file.string() + ".cells", options.effort);
  static_cast<void>(RunAll(own, directory, options.threads));
  Json shard{{"run", JsonOf(options, count)}, {"shard", index}, {"cells", Json::object()}};
  for (const Cell& cell : own) shard["cells"][cell.key()] = ReadJson(directory.path() / FileOf(cell));
  WriteFile(file, JsonText(shard, 1) + "\n");
}

void MergeShards(const std::vector<std::string>& files, RunOptions options, std::ostream& out) {
  Json run, cells;
  std::set<int> shards;
  for (const std::string& file : files) try {
      Json shard = ReadJson(file);
      if (run.is_null()) run = shard.at("run");
      if (shard.at("run") != run) throw std::runtime_error(file + ": is of another run than " + files.front());
      if (!shards.insert(shard.at("shard").get<int>()).second)
        throw std::runtime_error(file + ": its shard is there twice");
      cells.update(shard.at("cells"));
    } catch (const Json::exception&) {
      throw std::runtime_error(file + ": is no shard of a run");
    }
  if (run.is_null()) throw std::runtime_error("merge: no shard is named");
  try {
    if (std::ssize(shards) != run.at("shards").get<int>())
      throw std::runtime_error(files.front() + ": there are " + run.at("shards").dump() + " shards, of which " +
                               std::to_string(shards.size()) + " are named");
    run.at("names").get_to(options.names);
    run.at("seeds").get_to(options.scope.seeds);
    run.at("quick").get_to(options.scope.quick);
    run.at("scenarios").get_to(options.effort.scenarios);
    run.at("rollouts").get_to(options.effort.rollouts);
    run.at("command").get_to(options.origin.command);
  } catch (const Json::exception&) {
    throw std::runtime_error(files.front() + ": is no shard of a run");
  }
  if (options.directory.empty()) options.directory = DefaultDirectory(options.scope.quick);
  const RunDirectory directory(options.directory, options.effort);
  for (const Cell& cell : CellsOf(options)) {
    if (!cells.contains(cell.key())) throw std::runtime_error("merge: no shard has " + cell.key());
    WriteFile(directory.path() / FileOf(cell), JsonText(cells[cell.key()], 1) + "\n");
  }
  RunExperiments(options, out);
}

void RunExperiments(const RunOptions& options, std::ostream& out) {
  std::vector<const Experiment*> experiments;
  for (const std::string& name : options.names) experiments.push_back(&ExperimentNamed(name));
  const RunDirectory directory(options.directory, options.effort);
  const std::vector<Cell> cells = CellsOf(options);
  const Results results(options.scope, cells, RunAll(cells, directory, options.threads));

  const std::filesystem::path report_file = options.report.empty() ? directory.path() / "report.md" : options.report;
  const std::filesystem::path pictures = report_file.parent_path() / "figures";
  std::vector<Table> tables;
  std::string report;
  for (const Experiment* experiment : experiments) {
    const std::vector<Cell> own = CellsOf(*experiment, options.scope);
    std::vector<CellResult> of_own;
    for (const Cell& cell : own) of_own.push_back(results.Of(cell));
    if (!own.empty()) WriteFile(directory.path() / (experiment->name + ".csv"), ToCsv(own, of_own));
    for (const Table& table : experiment->tables(results)) {
      const std::string text = std::string(1, '\n').append(ToMarkdown(table));
      out << text << std::flush;
      report += text;
      tables.push_back(table);
    }
    if (!experiment->plots) continue;
    for (const Plot& plot : experiment->plots(results))
      if (Draw(plot, directory.path() / "plots", pictures))
        report += "\n![" + plot.caption + "](figures/" + plot.name + ".svg)\n\n" + plot.caption + "\n";
  }
  WriteFile(directory.path() / "tables.csv", ToCsv(tables));
  WriteFile(report_file, Preamble(options, tables) + report);
}

}  // namespace forereach::research
