// What changes with the representation of sets, the residual's bound and the noise.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "research/evaluate.h"
#include "research/experiment.h"
#include "research/methods/envelope.h"

namespace forereach::research {
namespace {

Cell WithOrder(Cell cell, int order) {
  cell.zonotope_order = order;
  return cell;
}

// ---- sets

std::vector<Cell> SetCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const System* system : Systems())
    for (const int observations : scope.SizesOf(*system))
      for (const int order : {5, 1}) AddSeeds(scope, WithOrder(PaperCell(*system, observations, 0, 0), order), cells);
  return cells;
}

// The mean over plans of the area of P X_T as a zonotope over that as a box; of those plans that both complete.
std::optional<double> MeanAreaRatio(const Tally& zonotope, const Tally& box) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < zonotope.areas.size(); ++i)
    if (zonotope.areas[i] >= 0 && box.areas[i] > 0) sum += zonotope.areas[i] / box.areas[i], ++count;
  if (count == 0) return std::nullopt;
  return sum / count;
}

Estimate AreaRatio(const Results& results, Cell cell, Group group) {
  std::vector<std::optional<double>> ratios;
  for (cell.seed = 0; cell.seed < results.scope.seeds; ++cell.seed)
    ratios.push_back(MeanAreaRatio(results.Of(cell, group), results.Of(WithOrder(cell, 1), group)));
  return EstimateOf(ratios);
}

// How much smaller the zonotopes' area is, in per cent: least and most over groups and N.
void AddReductions(const System& system, const Results& results, Table& table) {
  double least = kInfinity, most = -kInfinity;
  for (const int observations : results.scope.SizesOf(system))
    for (const Group group : kGroups)
      if (const auto ratio = AreaRatio(results, PaperCell(system, observations, 0, 0), group).mean)
        least = std::min(least, 100 * (1 - *ratio)), most = std::max(most, 100 * (1 - *ratio));
  const std::string why = "scenario bounds are ours, and the paper does not say over which cells and slices it goes";
  const auto row = [&](const char* what, const char* key, double ours) {
    table.Add(system.name + ", A to C, every N: " + what, {Mark::kOurs, PaperOrNone("sets." + system.name + key)}, ours,
              0, why);
  };
  row("least reduction of the area, %", ".least_reduction", least);
  row("largest, %", ".largest_reduction", most);
}

std::vector<Table> SetTables(const Results& results) {
  Table table{"Box against zonotope",
              "Noiseless. Order 1 makes every slice a box, order 5 is the paper's. Areas of P X_T, zonotope over box, "
              "of the plans that both complete."};
  for (const System* system : Systems()) {
    for (const int observations : results.scope.SizesOf(*system)) {
      const Cell cell = PaperCell(*system, observations, 0, 0);
      const bool in_paper = observations == system->sample_sizes.back();
      const std::string where = system->name + ", C, N = " + std::to_string(observations) + ": ";
      const auto paper = [&](Mark mark, const std::string& key) {
        return in_paper ? Reference(mark, Paper("sets." + system->name + ".C." + key)) : Reference();
      };
      table.Add(where + "area ratio", paper(Mark::kOurs, "area_ratio"), AreaRatio(results, cell, Group::kC), 3,
                "scenario bounds are ours, and the paper does not say which slices it averages");
      if (system == &PointMassSystem()) continue;
      table.Add(where + "certified, zonotope", paper(Mark::kFitted, "zonotope"),
                results.Mean(cell, Group::kC, CertificateRate), 3);
      table.Add(where + "certified, box", paper(Mark::kOurs, "box"),
                results.Mean(WithOrder(cell, 1), Group::kC, CertificateRate), 3);
    }
    AddReductions(*system, results, table);
  }
  return {table};
}

// ---- scalar

// |r_k(z) - r_k(z')| <= max L |z - z'|_1 for every k: one number in the matrix's place. As valid, and all the wider.
Cell ScalarCell() {
  const System& bicycle = BicycleSystem();
  Cell cell = PaperCell(bicycle, bicycle.sample_sizes.back(), 0, 0);
  cell.declared = {"scalar", Eigen::MatrixXd::Constant(bicycle.deployed.rows(), bicycle.deployed.cols(),
                                                       bicycle.deployed.maxCoeff())};
  return cell;
}

std::vector<Cell> ScalarCells(const Scope& scope) {
  std::vector<Cell> cells;
  AddSeeds(scope, ScalarCell(), cells);
  return cells;
}

std::vector<Table> ScalarTables(const Results& results) {
  Table table{"Scalar envelope",
              "Bicycle, N = 400, noiseless. Every entry of L is set to the largest entry, so a single number bounds "
              "the residual."};
  for (const Group group : kGroups) {
    const std::string where(1, NameOf(group));
    table.Add(where + ": certified", {Mark::kOurs, Paper("scalar.certified")},
              results.Mean(ScalarCell(), group, CertificateRate), 3);
    table.Add(where + ": D", {Mark::kOurs, Paper("scalar.domain")}, results.Mean(ScalarCell(), group, DomainRate), 3);
  }
  return {table};
}

// ---- noise

constexpr double kMultiples[] = {0, 0.33, 1, 3.3};
constexpr double kCuts[] = {1, 2, 3, 4, 5, 6, 8, 10};  // sigma / s
constexpr double kWorst = 3.3;                         // in multiples of the median residual

std::string Digits(double value) { return fmt::format("{:g}", value); }

double MedianOf(const System& system) {
  return &system == &BicycleSystem() ? Paper("median_residual").value : MedianResidual(system);
}

Cell NoisyCell(const System& system, double multiple, double cut = kNoiseCut) {
  Cell cell = PaperCell(system, system.sample_sizes.back(), multiple * MedianOf(system), 0);
  cell.cut = cut;
  if (cut != kNoiseCut) cell.declared.name += "_sigma_" + Digits(cut) + "_s";
  return cell;
}

std::vector<Cell> NoiseCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const System* system : Systems())
    for (const double multiple : kMultiples) AddSeeds(scope, NoisyCell(*system, multiple), cells);
  for (const double cut : kCuts) AddSeeds(scope, NoisyCell(BicycleSystem(), kWorst, cut), cells);
  return cells;
}

Table NoiseTable(const System& system, const Results& results) {
  const bool is_bicycle = &system == &BicycleSystem();
  Table table{is_bicycle ? "Noise" : "Noise, point mass",
              is_bicycle ? "Bicycle, C, N = 400. Noise N(0, s^2) in every state, cut at the declared sigma = 3 s; s in "
                           "multiples of the paper's median residual, 8.33e-5."
                         : "Point mass, C, N = 100. The same, s in multiples of the median residual over its data "
                           "region. The paper names this sweep and prints nothing of it.",
              {}};
  for (const double multiple : kMultiples) {
    const Cell cell = NoisyCell(system, multiple);
    const auto paper = is_bicycle ? PaperOrNone("noise.recall." + Digits(multiple)) : std::nullopt;
    table.Add("recall at " + Digits(multiple), {multiple == 0 ? Mark::kFitted : Mark::kOurs, paper},
              results.Mean(cell, Group::kC, Recall), 3,
              "the paper does not say what sigma it declares of Gaussian noise: the table of sigma / s");
    table.Add("coverage at " + Digits(multiple), results.Mean(cell, Group::kC, Coverage), 3);
  }
  table.Add("median residual over the data region",
            {Mark::kOurs, is_bicycle ? PaperOrNone("median_residual") : std::nullopt}, MedianResidual(system), 7,
            "the paper's data region is not in its text");
  return table;
}

Table CutTable(const Results& results) {
  Table table{"Noise, by the declared bound",
              "Bicycle, C, N = 400, s = 3.3 median residuals. The noise N(0, s^2) is cut at the declared sigma. The "
              "paper's recall there is " +
                  Digits(Paper("noise.recall.3.3").value) + ", and it does not say its sigma."};
  for (const double cut : kCuts) {
    const Cell cell = NoisyCell(BicycleSystem(), kWorst, cut);
    const std::string where = "sigma / s = " + Digits(cut) + ": ";
    table.Add(where + "recall", results.Mean(cell, Group::kC, Recall), 3);
    table.Add(where + "F", results.Mean(cell, Group::kC, FalsifiedRate), 3);
  }
  return table;
}

// ---- the noise's part of the envelope

constexpr int kPlansOfPart = 20;

// sigma_k over the width of the heading's envelope, at each step of the certified plans of C.
std::vector<double> NoiseParts(const Scope& scope) {
  const System& bicycle = BicycleSystem();
  const int observations = bicycle.sample_sizes.back();
  const double sigma = NoiseBound(bicycle.noise_scale);
  constexpr std::size_t kHeading = 2;
  std::vector<double> parts;
  for (int seed = 0; seed < scope.seeds; ++seed) {
    const Transitions data = MakeData(bicycle, Layout::kCorridor, seed, observations, bicycle.noise_scale);
    const Declaration declaration{bicycle.deployed, Eigen::VectorXd::Constant(bicycle.num_states(), sigma)};
    const auto residual = MakeForeReach({*bicycle.model, bicycle.domain, declaration, data, 0});
    const Evaluator evaluator(bicycle, *residual, 5);
    Answer answer;
    for (int i = 0; i < kPlansOfPart; ++i) {
      evaluator.Certify(MakeScenario(bicycle, Group::kC, seed, i), answer);
      if (answer.decision.outcome != Outcome::kCertified) continue;
      for (int t = 0; t < answer.tube.length(); ++t) {
        const ResidualBounds& envelope = answer.tube.step(t).envelope;
        parts.push_back(sigma / (envelope.upper[kHeading] - envelope.lower[kHeading]));
      }
    }
  }
  return parts;
}

Table PartTable(const Scope& scope) {
  Table table{"Noise in the residual's envelope",
              "Bicycle, sub-Gaussian channel, N = 400: the noise over the width of the heading's envelope, the median "
              "over the steps of certified plans of C. The paper does not say whether its noise term is s, sigma or "
              "both of the envelope's ends."};
  std::vector<double> parts = NoiseParts(scope);
  if (parts.empty()) return table;
  const auto middle = parts.begin() + static_cast<std::ptrdiff_t>(parts.size() / 2);
  std::ranges::nth_element(parts, middle);
  const std::string why = "scenario bounds and sigma = 3 s are ours";
  table.rows = {{"s", {Mark::kOurs, Paper("noise.envelope_part")}, *middle / kNoiseCut, 5, why},
                {"sigma", {}, *middle, 5, ""},
                {"2 sigma", {}, 2 * *middle, 5, ""}};
  return table;
}

std::vector<Table> NoiseTables(const Results& results) {
  return {NoiseTable(BicycleSystem(), results), CutTable(results), NoiseTable(PointMassSystem(), results),
          PartTable(results.scope)};
}

std::vector<Plot> NoisePlots(const Results& results) {
  std::string ours, paper;
  for (const double multiple : kMultiples) {
    const Estimate recall = results.Mean(NoisyCell(BicycleSystem(), multiple), Group::kC, Recall);
    ours += DataLine({multiple, recall.mean.value_or(NAN), recall.deviation});
  }
  // Without noise it is the recall at N = 400, of which the paper prints the spread.
  paper = DataLine({0, Paper("noise.recall.0").value, Paper("bicycle.C.recall.400").deviation}) +
          DataLine({3.3, Paper("noise.recall.3.3").value, 0});
  return {{"noise",
           "Recall of group C at N = 400 against the noise of the observations; mean and one standard deviation over "
           "the seeds; the paper's points are moved a little to the right. Its text does not give the sigma declared "
           "for its Gaussian noise; here it is 3 s.",
           720, 400,
           DataBlock("ours", ours) + DataBlock("paper", paper) + R"(set xrange [-0.15:3.6]; set yrange [0.8:1.01]
set xlabel 'noise scale s, in multiples of the median residual'; set ylabel 'certified recall, bicycle C'
set key bottom left
plot $ours using 1:2 with lines lw 2 lc rgb green notitle, \
  '' using 1:2:3 with yerrorbars pt 7 ps 0.7 lw 1.6 lc rgb green title 'ForeReach, here', \
  $paper using ($1+0.04):2:3 with yerrorbars pt 6 ps 1.2 lw 1.4 lc rgb grey title 'the paper; its spread only at 0'
)"}};
}

}  // namespace

Experiment BoxAgainstZonotope() { return {"sets", "boxes in the zonotopes' place", SetCells, SetTables}; }

Experiment ScalarEnvelope() { return {"scalar", "one number in the matrix's place", ScalarCells, ScalarTables}; }

Experiment NoiseSweep() { return {"noise", "recall as observations get noisier", NoiseCells, NoiseTables, NoisePlots}; }

}  // namespace forereach::research
