// Degradation of the nominal model: recall as a smaller part of the model is known.
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "research/experiment.h"
#include "research/variants.h"

namespace forereach::research {
namespace {

constexpr double kReference = 0.5;  // the paper's "common reference level"

// The missing parts, in per cent. The paper has 49 cells in 4D and 60 in 6D, and does not state them.
std::vector<double> PercentsOf(const Scope& scope) {
  return scope.quick ? std::vector<double>{5, 90} : std::vector<double>{0, 2, 5, 10, 20, 30, 40, 50, 60, 70, 80, 90};
}

Cell DegradedCell(const System& system, double percent) {
  return PaperCell(Degraded(system, percent / 100), system.sample_sizes.back(), 0, 0);
}

// The other readings, on fewer plans and parts.
constexpr int kPlans = 40;
constexpr std::pair<Lacking, const char*> kReadings[] = {{Lacking::kModel, "(1 - d) f0"},
                                                         {Lacking::kMotion, "x + (1 - d)(f0 - x)"},
                                                         {Lacking::kDeclaration, "f0, L of the first"},
                                                         {Lacking::kDeclarationOfMotion, "f0, L of the second"}};

std::vector<double> CoarsePercents(const Scope& scope) {
  return scope.quick ? std::vector<double>{0, 40} : std::vector<double>{0, 1, 2, 5, 10, 20, 40};
}

Cell ReadingCell(const System& system, Lacking lacking, double percent) {
  const System& degraded = Degraded(WithFewerPlans(system, kPlans), percent / 100, lacking);
  return PaperCell(degraded, system.sample_sizes.back(), 0, 0);
}

std::vector<Cell> DegradationCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const System* system : Systems())
    for (const auto& [lacking, name] : kReadings)
      for (const double percent : CoarsePercents(scope)) AddSeeds(scope, ReadingCell(*system, lacking, percent), cells);
  for (const System* system : Systems())
    for (const double percent : PercentsOf(scope)) AddSeeds(scope, DegradedCell(*system, percent), cells);
  return cells;
}

// Where the line through the means first comes down to the reference; none if it does not.
std::optional<double> Crossing(const std::vector<double>& at, const std::vector<double>& recall) {
  for (std::size_t i = 1; i < at.size(); ++i)
    if (recall[i - 1] >= kReference && recall[i] < kReference)
      return at[i - 1] + (at[i] - at[i - 1]) * (recall[i - 1] - kReference) / (recall[i - 1] - recall[i]);
  return std::nullopt;
}

std::string Percent(double value) { return fmt::format("{:.5g} %", value); }

Table ReadingTable(const Results& results) {
  Table table{"Nominal degradation, readings",
              "C, noiseless, the largest N, " + std::to_string(kPlans) +
                  " plans a seed. What \"degraded\" may mean: the model is (1 - d) f0; or it moves the state by a part "
                  "of what it should, x + (1 - d)(f0 - x); or it is f0, and only L is declared as of one of them. L "
                  "grows by what the model lacks. The paper: " +
                  Percent(Paper("degradation.point_mass").value) + " and " +
                  Percent(Paper("degradation.bicycle").value) + ".",
              {}};
  const std::vector<double> percents = CoarsePercents(results.scope);
  for (const System* system : Systems())
    for (const auto& [lacking, name] : kReadings) {
      const std::string where = system->name + ", " + name;
      std::vector<double> recalls;
      std::vector<Row> rows;
      for (const double percent : percents) {
        const Estimate recall = results.Mean(ReadingCell(*system, lacking, percent), Group::kC, Recall);
        recalls.push_back(recall.mean.value_or(0));
        rows.push_back({where + ", d = " + Percent(percent) + ": C recall", {}, recall, 3, ""});
      }
      const std::optional<double> crossing = Crossing(percents, recalls);
      table.Add(where + ": tolerated, %", crossing, 3);
      table.rows.insert(table.rows.end(), rows.begin(), rows.end());
    }
  return table;
}

std::vector<Table> DegradationTables(const Results& results) {
  Table table{
      "Nominal degradation",
      "C, noiseless, the largest N. The nominal model is (1 - d) f0, and L grows by d sup |D f0|: at d = 1 there is no "
      "model, and L is the L_f of the norm ratios. \"Tolerated\": the d at which recall comes down to 0.5."};
  const std::vector<double> percents = PercentsOf(results.scope);
  for (const System* system : Systems()) {
    std::vector<double> recalls;
    std::vector<Row> rows;
    int false_certificates = 0;
    for (const double percent : percents) {
      const Cell cell = DegradedCell(*system, percent);
      const Estimate recall = results.Mean(cell, Group::kC, Recall);
      recalls.push_back(recall.mean.value_or(0));
      false_certificates += results.FalseCertificates(cell);
      rows.push_back({system->name + ", d = " + Percent(percent) + ": C recall", {}, recall, 3, ""});
    }
    const std::optional<double> crossing = Crossing(percents, recalls);
    table.Add(system->name + ": tolerated, %", {Mark::kOurs, Paper("degradation." + system->name)}, crossing, 3,
              "the paper does not say what degrades, nor how much of it it declares");
    table.Add(system->name + ": cells of the scan", {Mark::kOurs, Paper("degradation." + system->name + ".cells")},
              static_cast<double>(percents.size()), 0, "the paper does not state its cells");
    table.Add(system->name + ": false certificates, all groups", false_certificates, 0);
    table.rows.insert(table.rows.end(), rows.begin(), rows.end());
  }
  return {table, ReadingTable(results)};
}

std::vector<Plot> DegradationPlots(const Results& results) {
  std::string lines;
  for (const double percent : PercentsOf(results.scope)) {
    const auto recall = [&](const System& system) {
      return results.Mean(DegradedCell(system, percent), Group::kC, Recall);
    };
    const Estimate point_mass = recall(PointMassSystem()), bicycle = recall(BicycleSystem());
    lines += DataLine(
        {percent, point_mass.mean.value_or(NAN), point_mass.deviation, bicycle.mean.value_or(NAN), bicycle.deviation});
  }
  const std::string paper = DataLine({Paper("degradation.point_mass").value, kReference}) + "\n\n" +
                            DataLine({Paper("degradation.bicycle").value, kReference});
  return {{"degradation",
           "Recall of group C against the degradation of the nominal model, mean and one standard deviation over the "
           "seeds. At 100 % the nominal model is zero. The paper prints where its recall comes down to the reference, "
           "and no spread.",
           720, 400, DataBlock("recall", lines) + DataBlock("paper", paper) + R"(set yrange [0:1.05]; set xrange [0:100]
set xlabel 'degradation d, %'; set ylabel 'certified recall, C'
set key outside top center horizontal maxcols 3
plot 0.5 with lines dt 2 lc rgb grey title 'half: the paper''s reference', \
  $recall using 1:2:3 with yerrorlines pt 7 ps 0.6 lw 1.8 lc rgb blue title 'point mass, N = 100', \
  '' using 1:4:5 with yerrorlines pt 5 ps 0.6 lw 1.8 lc rgb green title 'bicycle, N = 400', \
  $paper index 0 using 1:2 with points pt 6 ps 1.4 lw 2 lc rgb blue title 'the paper, point mass', \
  '' index 1 using 1:2 with points pt 4 ps 1.4 lw 2 lc rgb green title 'the paper, bicycle'
)"}};
}

}  // namespace

Experiment NominalDegradation() {
  return {"degradation", "recall as the nominal model gets worse", DegradationCells, DegradationTables,
          DegradationPlots};
}

}  // namespace forereach::research
