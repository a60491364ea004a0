// Plans of a learned policy: certificate rate and recall by layout and N, whether abstention follows the distance to
// the data, and where certification first stops.
#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "research/chunks/blocks.h"
#include "research/chunks/demonstrations.h"
#include "research/chunks/support.h"
#include "research/experiment.h"

namespace forereach::research {
namespace {

constexpr Layout kLayouts[] = {Layout::kFixedGrid, Layout::kPolicyCorridor};

Cell ChunkCell(Layout layout, int observations, double noise) {
  Cell cell = PaperCell(ChunkSystem(), observations, noise, 0);
  cell.layout = layout;
  return cell;
}

// Of one channel, every seed.
std::vector<Cell> CellsOf(const Scope& scope, Layout layout, double noise) {
  std::vector<Cell> cells;
  for (const int observations : scope.SizesOf(ChunkSystem()))
    AddSeeds(scope, ChunkCell(layout, observations, noise), cells);
  return cells;
}

std::vector<Cell> Cells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const double noise : {0.0, ChunkSystem().noise_scale})
    for (const Layout layout : kLayouts) std::ranges::move(CellsOf(scope, layout, noise), std::back_inserter(cells));
  return cells;
}

std::string Words(Layout layout) { return layout == Layout::kFixedGrid ? "fixed grid" : "policy corridor"; }

// The counts of all groups: the paper's table has no others.
Tally Together(const CellResult& result) {
  Tally all;
  for (const Tally& tally : result) {
    all.plans += tally.plans, all.safe += tally.safe, all.certified += tally.certified;
    all.certified_safe += tally.certified_safe, all.falsified += tally.falsified, all.domain += tally.domain;
    all.safety += tally.safety, all.covered += tally.covered, all.undecided += tally.undecided;
  }
  return all;
}

Estimate OverSeedsAndGroups(const Results& results, Cell cell, Statistic statistic) {
  std::vector<std::optional<double>> values;
  for (cell.seed = 0; cell.seed < results.scope.seeds; ++cell.seed)
    values.push_back(statistic(Together(results.Of(cell))));
  return EstimateOf(values);
}

std::optional<double> SafeRate(const Tally& tally) { return static_cast<double>(tally.safe) / tally.plans; }

const char* const kWhy = "the paper's errands, obstacles and sample points are not in its text";

Table OutcomeTable(const Results& results, double noise) {
  Table table{
      noise == 0 ? "Action chunks" : "Action chunks, sub-Gaussian channel",
      noise == 0
          ? "Blocks of 20 steps of a behaviour-cloned policy, groups A to C together, noiseless. The policy's task, "
            "its training, the grid and the corridor are our own: `research/chunks/demonstrations.h` and `blocks.h`."
          : "The same, s = 4.16e-6, cut at sigma = 3 s. The paper: within one point of its noiseless rows."};
  for (const Layout layout : kLayouts)
    for (const int observations : results.scope.SizesOf(ChunkSystem())) {
      const std::string n = std::to_string(observations), where = Words(layout) + ", N = " + n + ": ";
      const std::string key = std::string("chunks.") + NameOf(layout) + ".";
      const auto row = [&](const char* what, const Reference& paper, Statistic statistic, bool follows = false) {
        const Cell cell = ChunkCell(layout, observations, noise);
        table.Add(where + what, paper, OverSeedsAndGroups(results, cell, statistic), 3, kWhy, follows);
      };
      row("certificate rate", {Mark::kOurs, Paper(key + "rate." + n)}, CertificateRate);
      // In both, two thirds of the plans are target-safe: 1.5 times the rate.
      row("recall", {Mark::kOurs, Paper(key + "recall." + n)}, Recall, true);
      row("coverage", {Mark::kOurs, Paper("chunks.coverage")}, Coverage);
      row("D", {}, DomainRate);
      row("S", {}, SafetyRate);
    }
  return table;
}

Table GroupTable(const Results& results) {
  const int most = ChunkSystem().sample_sizes.back();
  Table table{"Action chunks by group", "Noiseless, the largest N. The paper does not report these figures."};
  for (const Layout layout : kLayouts)
    for (const Group group : kGroups)
      for (const auto& [what, statistic] : std::initializer_list<std::pair<const char*, Statistic>>{
               {"target-safe", SafeRate}, {"recall", Recall}, {"D", DomainRate}, {"S", SafetyRate}})
        table.Add(Words(layout) + ", " + NameOf(group) + ": " + what,
                  results.Mean(ChunkCell(layout, most, 0), group, statistic), 3);
  return table;
}

std::vector<SupportRecord> RecordsOf(const std::vector<Cell>& cells, const Results& results) {
  std::vector<SupportRecord> records;
  for (const Cell& cell : cells)
    for (const Tally& tally : results.Of(cell))
      for (std::size_t i = 0; i < tally.distances.size(); ++i)
        records.push_back({tally.distances[i], tally.answers[i] != 'C'});
  return records;
}

Table SupportTable(const Results& results) {
  Table table{"Action chunks and distance to the data",
              "d: the largest distance of a nominal state to its nearest observation, in units of the paper. "
              "Noiseless, every N and seed. The paper's 45,000 records are those of one layout, and its text does not "
              "say which: it is compared with the fixed grid here."};
  for (const Layout layout : kLayouts) {
    const auto paper = [&](const char* key) {
      return layout == Layout::kFixedGrid ? Reference(Mark::kOurs, Paper(key)) : Reference();
    };
    const std::vector<SupportRecord> records = RecordsOf(CellsOf(results.scope, layout, 0), results);
    const SupportStatistic support = SupportOf(records);
    const std::string where = Words(layout) + ": ";
    table.rows.insert(
        table.rows.end(),
        {{where + "records", paper("chunks.support.records"), double(records.size()), 0, "this run has fewer"},
         {where + "Spearman correlation of d and abstention", paper("chunks.support.spearman"), support.spearman, 3,
          kWhy},
         {where + "abstention, nearest quarter", paper("chunks.support.nearest"), support.nearest, 3, kWhy},
         {where + "abstention, farthest quarter", paper("chunks.support.farthest"), support.farthest, 3, kWhy},
         {where + "gap", paper("chunks.support.gap"), support.gap(), 3, kWhy, true}});
  }
  return table;
}

Table SoundnessTable(const Results& results) {
  const std::vector<Cell> cells = Cells(results.scope);
  int wrong = 0, uncovered = 0, undecided = 0;
  for (const Cell& cell : cells)
    for (const Tally& tally : results.Of(cell)) {
      wrong += tally.false_certificates();
      uncovered += tally.complete() - tally.covered;
      undecided += tally.undecided;
    }
  return {
      "Action chunks, soundness",
      "Both layouts and channels, every N and seed.",
      {{"cells", {Mark::kExact, Paper("chunks.cells")}, double(cells.size()), 0, "this run has fewer"},
       {"complete tubes that do not contain every rollout", {Mark::kOurs, Paper("chunks.uncovered")}, uncovered, 0, ""},
       {"of these, membership undecided", {}, undecided, 0, ""},
       {"false certificates", {Mark::kOurs, Paper("chunks.false_certificates")}, wrong, 0, ""}}};
}

// The part of all plans that abstains first at a step.
Estimate PartAt(const Results& results, Cell cell, bool is_domain, std::size_t t) {
  std::vector<std::optional<double>> parts;
  for (cell.seed = 0; cell.seed < results.scope.seeds; ++cell.seed) {
    double count = 0, plans = 0;
    for (const Tally& tally : results.Of(cell)) {
      count += (is_domain ? tally.domain_steps : tally.safety_steps)[t];
      plans += tally.plans;
    }
    parts.push_back(count / plans);
  }
  return EstimateOf(parts);
}

Table StepTable(const Results& results) {
  Table table{"Action chunks, first abstention",
              "Noiseless, the largest N: the part of all plans that abstains first at a step. The paper shows these as "
              "a picture."};
  for (const Layout layout : kLayouts)
    for (const bool is_domain : {true, false})
      for (std::size_t t = 0; t <= kBlockSteps; ++t) {
        const Estimate part = PartAt(results, ChunkCell(layout, ChunkSystem().sample_sizes.back(), 0), is_domain, t);
        if (*part.mean == 0) continue;
        table.Add(Words(layout) + (is_domain ? ": D at step " : ": S at step ") + std::to_string(t), part, 4);
      }
  return table;
}

std::vector<Plot> Plots(const Results& results) {
  Plot plot{"chunk-steps",
            "The step at which a block of the learned policy first abstains, noiseless, N = 400, as a part of all "
            "blocks of groups A to C; mean over the seeds.",
            900, 400,
            "set multiplot layout 1,2\nset style data histogram\nset style histogram clustered gap 1\n"
            "set style fill solid 0.9 noborder\nset yrange [0:0.14<*]\nset xlabel 'step'\n"
            "set ylabel 'part of the blocks'\nset key top left\n"};
  std::string data;
  for (const Layout layout : kLayouts) {
    std::string lines;
    for (std::size_t t = 0; t <= kBlockSteps; ++t) {
      const auto part = [&](bool is_domain) {
        return *PartAt(results, ChunkCell(layout, ChunkSystem().sample_sizes.back(), 0), is_domain, t).mean;
      };
      lines += DataLine({static_cast<double>(t), part(true), part(false)});
    }
    data += DataBlock(NameOf(layout), lines);
    plot.script += "set title '" + Words(layout) + "'\nplot $" + NameOf(layout) +
                   " using 2:xtic(int($1) % 2 ? '' : stringcolumn(1)) lc rgb blue title 'leaves the domain (D)', '' "
                   "using 3 lc rgb orange title 'may touch the obstacle (S)'\n";
  }
  plot.script = data + plot.script + "unset multiplot\n";
  return {plot};
}

std::vector<Table> Tables(const Results& results) {
  return {OutcomeTable(results, 0), OutcomeTable(results, ChunkSystem().noise_scale),
          GroupTable(results),      SupportTable(results),
          SoundnessTable(results),  StepTable(results)};
}

}  // namespace

Experiment ActionChunks() {
  return {"chunks", "plans of a learned policy: outcomes by layout and N, distance to the data", Cells, Tables, Plots};
}

}  // namespace forereach::research
