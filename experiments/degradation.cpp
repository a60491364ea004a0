// How much of the nominal model a certifier can lose: recall as the model knows less of each step's motion.
#include <cstdio>
#include <string>
#include <vector>

#include "experiments/experiment.h"
#include "experiments/variants.h"

namespace forereach::experiments {
namespace {

constexpr double kReference = 0.5;  // the paper's "common reference level"

// The parts lacking, in per cent. The paper has 49 cells in 4D and 60 in 6D, and does not say which.
std::vector<double> PercentsOf(const Scope& scope, const System& system) {
  if (&system == &PointMassSystem())
    return scope.quick ? std::vector<double>{5, 20} : std::vector<double>{0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 25, 30};
  return scope.quick ? std::vector<double>{0.5, 4}
                     : std::vector<double>{0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.5, 3, 4};
}

Cell DegradedCell(const System& system, double percent) {
  return PaperCell(Degraded(system, percent / 100), system.sample_sizes.back(), 0, 0);
}

std::vector<Cell> DegradationCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const System* system : Systems())
    for (const double percent : PercentsOf(scope, *system)) AddSeeds(scope, DegradedCell(*system, percent), cells);
  return cells;
}

// Where the line through the means first comes down to the reference; none if it does not.
std::optional<double> Crossing(const std::vector<double>& at, const std::vector<double>& recall) {
  for (std::size_t i = 1; i < at.size(); ++i)
    if (recall[i - 1] >= kReference && recall[i] < kReference)
      return at[i - 1] + (at[i] - at[i - 1]) * (recall[i - 1] - kReference) / (recall[i - 1] - recall[i]);
  return std::nullopt;
}

std::vector<Table> DegradationTables(const Scope& scope, const Results& results) {
  Table table{"Nominal degradation",
              "C, noiseless, the largest N. The nominal model knows the part 1 - d of each step's motion, and L grows "
              "by what it lacks: variants.h. \"Tolerated\": the d at which recall comes down to 0.5.",
              {}};
  for (const System* system : Systems()) {
    const std::vector<double> percents = PercentsOf(scope, *system);
    std::vector<double> recalls;
    std::vector<Row> rows;
    int false_certificates = 0;
    for (const double percent : percents) {
      char text[16];
      std::snprintf(text, sizeof text, "%g %%", percent);
      const Cell cell = DegradedCell(*system, percent);
      const Estimate recall = OverSeeds(scope, results, cell, Group::kC, Recall);
      recalls.push_back(recall.mean.value_or(0));
      false_certificates += FalseCertificates(scope, results, cell);
      rows.push_back({system->name + ", d = " + text + ": C recall", {}, recall, 3, ""});
    }
    const std::optional<double> crossing = Crossing(percents, recalls);
    table.rows.push_back({system->name + ": tolerated, %", Paper("degradation." + system->name),
                          crossing ? Exactly(*crossing) : Estimate{}, 3,
                          "the paper does not say what degrades, nor how much of it it declares"});
    table.rows.push_back({system->name + ": false certificates, all groups", Paper("false_certificates"),
                          Exactly(false_certificates), 0, ""});
    table.rows.insert(table.rows.end(), rows.begin(), rows.end());
  }
  return {table};
}

}  // namespace

Experiment NominalDegradation() {
  return {"degradation", "recall as the nominal model gets worse", DegradationCells, DegradationTables};
}

}  // namespace forereach::experiments
