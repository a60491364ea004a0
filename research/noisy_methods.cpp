// The comparison of methods under noisy observations.
#include <string>
#include <vector>

#include "research/experiment.h"
#include "research/variants.h"

namespace forereach::research {
namespace {

constexpr int kPlans = 40, kSizes[] = {25, 400};

Cell NoisyCell(const Method& method, int observations) {
  const System& bicycle = WithFewerPlans(BicycleSystem(), kPlans);
  Cell cell = PaperCell(bicycle, observations, bicycle.noise_scale, 0);
  cell.method = method;
  return cell;
}

std::vector<Cell> Cells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const Method& method : Methods())
    for (const int observations : kSizes) AddSeeds(scope, NoisyCell(method, observations), cells);
  return cells;
}

std::vector<Table> Tables(const Results& results) {
  Table table{"Methods, bicycle, sub-Gaussian channel",
              "s = 4.16e-6, cut at sigma = 3 s; " + std::to_string(kPlans) +
                  " plans a group and seed. The paper's figures for the other methods are without noise.",
              {}};
  for (const Method& method : Methods())
    for (const int observations : kSizes) {
      const std::string where = method.name + ", N = " + std::to_string(observations) + ": ";
      const auto row = [&](const char* what, Group group, Statistic statistic) {
        table.Add(where + what, results.Mean(NoisyCell(method, observations), group, statistic), 4);
      };
      row("B coverage", Group::kB, Coverage);
      row("C recall", Group::kC, Recall);
    }
  return {table};
}

}  // namespace

Experiment NoisyComparison() { return {"methods-noisy", "every method under the sub-Gaussian channel", Cells, Tables}; }

}  // namespace forereach::research
