// The adversarial residual family: targets that agree on all low-speed data, and whose slopes beyond them have no
// bound. What a declaration is worth that is true, that is kept while the target steepens, that is read off the data.
#include <string>
#include <vector>

#include "forereach/residual/observations.h"
#include "identify/slopes.h"
#include "research/experiment.h"
#include "research/methods/envelope.h"
#include "research/variants.h"

namespace forereach::research {
namespace {

Declaration EstimateFrom(const NominalModel& model, const Declaration& declared, const Transitions& data) {
  return EstimatedDeclaration(SlopeEstimator::kLacki, declared, Observe(model, data), 0);
}

std::unique_ptr<ResidualEnclosure> MakePlugIn(const Setting& setting) {
  return MakeForeReach(setting, EstimateFrom(setting.model, setting.declaration, setting.data));
}

const Method kPlugIn{"Plug-in slopes", MakePlugIn};

std::vector<double> LambdasOf(const Scope& scope) {
  return scope.quick ? std::vector<double>{1, 4, 32} : std::vector<double>{1, 2, 4, 8, 16, 32};
}

Cell TrueCell(double lambda) {
  const System& system = Escaping(lambda);
  Cell cell = PaperCell(system, system.sample_sizes.back(), 0, 0);
  cell.layout = Layout::kBelowKnee;
  return cell;
}

// The declaration of the knee, for every target.
Cell KeptCell(double lambda) {
  Cell cell = TrueCell(lambda);
  cell.declared = {"kept", PointMassSystem().deployed};
  return cell;
}

Cell PlugInCell(double lambda) {
  Cell cell = KeptCell(lambda);
  cell.method = kPlugIn;
  return cell;
}

std::vector<Cell> FamilyCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const double lambda : LambdasOf(scope))
    for (const Cell& cell : {TrueCell(lambda), KeptCell(lambda), PlugInCell(lambda)}) AddSeeds(scope, cell, cells);
  return cells;
}

// The largest entry of the estimate from the data, relative to the deployed matrix's.
Estimate EstimatedPart(const Scope& scope, double lambda) {
  const System& system = Escaping(lambda);
  const Declaration kept{PointMassSystem().deployed, Eigen::VectorXd::Zero(system.num_states())};
  std::vector<std::optional<double>> parts;
  for (int seed = 0; seed < scope.seeds; ++seed) {
    const Transitions data = MakeData(system, Layout::kBelowKnee, seed, system.sample_sizes.back(), 0);
    parts.push_back(EstimateFrom(*system.model, kept, data).lipschitz.maxCoeff() / kept.lipschitz.maxCoeff());
  }
  return EstimateOf(parts);
}

double TruePart(double lambda) { return Escaping(lambda).deployed.maxCoeff() / PointMassSystem().deployed.maxCoeff(); }

void AddOutcomes(const Results& results, const std::string& where, const Cell& cell, Table& table) {
  const auto row = [&](const char* what, Group group, Statistic statistic) {
    table.Add(where + what, results.Mean(cell, group, statistic), 3);
  };
  row("A coverage", Group::kA, Coverage);
  row("A certified", Group::kA, CertificateRate);
  row("C coverage", Group::kC, Coverage);
  row("C certified", Group::kC, CertificateRate);
  table.Add(where + "false certificates, all groups", results.FalseCertificates(cell), 0);
}

std::vector<Table> FamilyTables(const Results& results) {
  Table slopes{"Adversarial residual family: slopes",
               "r_lambda = [1 + (lambda - 1) SmoothGate((s - 0.9) / 0.14)] r over the speed s, r the knee's: the "
               "family is ours, the paper prints no formula. Noiseless data from below the knee, N = 100, the same for "
               "every lambda. Largest velocity slope over the deployed matrix's: a proved bound on the true one, and "
               "LACKI's estimate from the data."};
  Table outcomes{"Adversarial residual family: plans",
                 "The same data. The declaration is one of three: the true slopes, the matrix deployed for lambda = 1, "
                 "or the estimate. The data refute none of them."};
  for (const double lambda : LambdasOf(results.scope)) {
    const std::string where = "lambda = " + std::to_string(static_cast<int>(lambda)) + ": ";
    slopes.Add(where + "true", TruePart(lambda), 3);
    // All targets agree on the data, so this is one figure, compared once.
    slopes.Add(where + "estimate", lambda == 1 ? Reference(Mark::kOurs, Paper("slopes")) : Reference(),
               EstimatedPart(results.scope, lambda), 3,
               "the paper's residual is flat at every sample, the softplus not quite");
    AddOutcomes(results, where + "true, ", TrueCell(lambda), outcomes);
    AddOutcomes(results, where + "kept, ", KeptCell(lambda), outcomes);
    AddOutcomes(results, where + "estimate, ", PlugInCell(lambda), outcomes);
  }
  return {slopes, outcomes};
}

Plot ProfilePlot() {
  std::string lines;
  for (int i = 0; i <= 150; ++i) {
    const double speed = 0.02 * i;
    lines += DataLine({speed, EscapeAt(1, speed), EscapeAt(2, speed), EscapeAt(4, speed), EscapeAt(8, speed),
                       EscapeAt(16, speed), EscapeAt(32, speed)});
  }
  return {
      "adversarial-profiles",
      "Adversarial family: all members agree up to the knee, so they agree on all data below it.", 720, 400,
      DataBlock("profile", lines) + R"(set xrange [0:3]; set logscale y; set yrange [1e-4:100]; set format y '10^{%T}'
set arrow from 0.9, graph 0 to 0.9, graph 1 nohead dt 2 lc rgb grey
set label 'knee' at 0.93, graph 0.95 textcolor rgb grey
set object rectangle from 0, graph 0 to 0.283, graph 1 fc rgb sky fs solid 0.2 noborder behind
set label 'data' at 0.06, graph 0.95 textcolor rgb grey
set xlabel 'speed, m/s'; set ylabel 'size of the residual acceleration, m/s^2'
set key outside right center
plot $profile using 1:7 with lines lw 2 lc rgb '#222222' title 'lambda = 32', \
  '' using 1:6 with lines lw 2 lc rgb purple title '16', '' using 1:5 with lines lw 2 lc rgb red title '8', \
  '' using 1:4 with lines lw 2 lc rgb orange title '4', '' using 1:3 with lines lw 2 lc rgb green title '2', \
  '' using 1:2 with lines lw 2 lc rgb blue title '1, deployed'
)"};
}

Plot SlopePlot(const Scope& scope) {
  const double deployed = PointMassSystem().deployed.maxCoeff();
  std::string lines;
  for (const double lambda : LambdasOf(scope)) {
    const Estimate estimate = EstimatedPart(scope, lambda);
    lines += DataLine({lambda, deployed * TruePart(lambda), deployed * estimate.mean.value_or(0), deployed,
                       deployed * estimate.deviation});
  }
  return {"adversarial-slopes",
          "Adversarial family: the true slope grows with lambda, past any bound once declared, while the data and the "
          "estimates from them stay the same. Estimate: mean and one standard deviation over the seeds.",
          720, 400, DataBlock("slope", lines) + R"(set logscale xy; set xrange [1:32]; set yrange [1e-4:10]
set format y '10^{%T}'; set xtics (1, 2, 4, 8, 16, 32)
set xlabel 'lambda, no unit'; set ylabel 'largest slope of r_v by v, (m/s)/(m/s)'
set key outside top center horizontal
plot $slope using 1:2 with linespoints pt 7 ps 0.6 lw 2 lc rgb red title 'true', \
  '' using 1:4 with lines dt 2 lw 2 lc rgb grey title 'deployed for lambda = 1', \
  '' using 1:3:5 with yerrorlines pt 5 ps 0.6 lw 2 lc rgb blue title 'estimate from data below the knee'
)"};
}

std::vector<Plot> FamilyPlots(const Results& results) { return {ProfilePlot(), SlopePlot(results.scope)}; }

}  // namespace

Experiment AdversarialFamily() {
  return {"adversarial", "targets that low-speed data cannot tell apart, ever steeper beyond", FamilyCells,
          FamilyTables, FamilyPlots};
}

}  // namespace forereach::research
