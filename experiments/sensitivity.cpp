// What changes with the representation of sets, the residual's bound and the noise.
#include <cmath>
#include <cstdio>
#include <string>

#include "experiments/experiment.h"

namespace forereach::experiments {
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

Estimate AreaRatio(const Scope& scope, const Results& results, Cell cell, Group group) {
  std::vector<std::optional<double>> ratios;
  for (cell.seed = 0; cell.seed < scope.seeds; ++cell.seed)
    ratios.push_back(MeanAreaRatio(results.Of(cell, group), results.Of(WithOrder(cell, 1), group)));
  return EstimateOf(ratios);
}

std::vector<Table> SetTables(const Scope& scope, const Results& results) {
  Table table{
      "Box against zonotope",
      "Noiseless. Order 1 makes every slice a box, order 5 is the paper's. Areas of P X_T, zonotope over box, of "
      "the plans that both complete.",
      {}};
  for (const System* system : Systems())
    for (const int observations : scope.SizesOf(*system)) {
      const Cell cell = PaperCell(*system, observations, 0, 0);
      const bool in_paper = observations == system->sample_sizes.back();
      const std::string where = system->name + ", C, N = " + std::to_string(observations) + ": ";
      const auto paper = [&](Mark mark, const std::string& key) {
        return in_paper ? Reference(mark, Paper("sets." + system->name + ".C." + key)) : Reference();
      };
      table.rows.push_back({where + "area ratio", paper(Mark::kOurs, "area_ratio"),
                            AreaRatio(scope, results, cell, Group::kC), 3,
                            "scenario bounds are ours, and the paper does not say which slices it averages"});
      if (system == &PointMassSystem()) continue;
      table.rows.push_back({where + "certified, zonotope", paper(Mark::kFitted, "zonotope"),
                            OverSeeds(scope, results, cell, Group::kC, CertificateRate), 3, ""});
      table.rows.push_back({where + "certified, box", paper(Mark::kOurs, "box"),
                            OverSeeds(scope, results, WithOrder(cell, 1), Group::kC, CertificateRate), 3, ""});
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

std::vector<Table> ScalarTables(const Scope& scope, const Results& results) {
  Table table{"Scalar envelope",
              "Bicycle, N = 400, noiseless. Every entry of L is set to the largest entry, so a single number bounds "
              "the residual.",
              {}};
  for (const Group group : kGroups) {
    const std::string where(1, NameOf(group));
    table.rows.push_back({where + ": certified",
                          {Mark::kOurs, Paper("scalar.certified")},
                          OverSeeds(scope, results, ScalarCell(), group, CertificateRate),
                          3,
                          ""});
    table.rows.push_back({where + ": D",
                          {Mark::kOurs, Paper("scalar.domain")},
                          OverSeeds(scope, results, ScalarCell(), group, DomainRate),
                          3,
                          ""});
  }
  return {table};
}

// ---- noise

constexpr double kMultiples[] = {0, 0.33, 1, 3.3};

Cell NoisyCell(double multiple) {
  const System& bicycle = BicycleSystem();
  return PaperCell(bicycle, bicycle.sample_sizes.back(), multiple * Paper("median_residual").value, 0);
}

std::vector<Cell> NoiseCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const double multiple : kMultiples) AddSeeds(scope, NoisyCell(multiple), cells);
  return cells;
}

std::vector<Table> NoiseTables(const Scope& scope, const Results& results) {
  Table table{
      "Noise",
      "Bicycle, C, N = 400. Noise N(0, s^2) in every state, cut at the declared sigma = 3 s; s in multiples of the "
      "paper's median residual, 8.33e-5.",
      {}};
  for (const double multiple : kMultiples) {
    char text[16];
    std::snprintf(text, sizeof text, "%g", multiple);
    const bool in_paper = multiple == 0 || multiple == 3.3;
    table.rows.push_back({std::string("recall at ") + text,
                          {multiple == 0 ? Mark::kFitted : Mark::kOurs,
                           in_paper ? PaperOrNone(std::string("noise.recall.") + text) : std::nullopt},
                          OverSeeds(scope, results, NoisyCell(multiple), Group::kC, Recall),
                          3,
                          "the paper does not say what sigma it declares of Gaussian noise; here 3 s"});
    table.rows.push_back({std::string("coverage at ") + text,
                          {},
                          OverSeeds(scope, results, NoisyCell(multiple), Group::kC, Coverage),
                          3,
                          ""});
  }
  table.rows.push_back({"median residual over the data region",
                        {Mark::kOurs, Paper("median_residual")},
                        Exactly(MedianResidual(BicycleSystem())),
                        7,
                        "the paper's data region is not in its text"});
  return {table};
}

std::vector<Plot> NoisePlots(const Scope& scope, const Results& results) {
  std::string ours, paper;
  for (const double multiple : kMultiples) {
    const Estimate recall = OverSeeds(scope, results, NoisyCell(multiple), Group::kC, Recall);
    ours += DataLine({multiple, recall.mean.value_or(NAN), recall.deviation});
  }
  for (const char* multiple : {"0", "3.3"})
    paper += DataLine({std::stod(multiple), Paper(std::string("noise.recall.") + multiple).value});
  return {{"noise",
           "Recall of group C at N = 400 against the noise of the observations; mean and one standard deviation over "
           "the seeds. The paper's text does not give the sigma declared for its Gaussian noise; here it is 3 s.",
           720, 400,
           DataBlock("ours", ours) + DataBlock("paper", paper) + R"(set xrange [-0.15:3.6]; set yrange [0.8:1.01]
set xlabel 'noise scale s, in multiples of the median residual'; set ylabel 'certified recall, bicycle C'
set key bottom left
plot $ours using 1:2 with lines lw 2 lc rgb green notitle, \
  '' using 1:2:3 with yerrorbars pt 7 ps 0.7 lw 1.6 lc rgb green title 'ForeReach, here', \
  $paper using 1:2 with points pt 9 ps 1.3 lc rgb grey title 'paper'
)"}};
}

}  // namespace

Experiment BoxAgainstZonotope() { return {"sets", "boxes in the zonotopes' place", SetCells, SetTables}; }

Experiment ScalarEnvelope() { return {"scalar", "one number in the matrix's place", ScalarCells, ScalarTables}; }

Experiment NoiseSweep() { return {"noise", "recall as observations get noisier", NoiseCells, NoiseTables, NoisePlots}; }

}  // namespace forereach::experiments
