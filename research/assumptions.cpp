// The two assumptions that data can refute and that suffice if true: affine residuals and declared slopes, each on a
// target that is affine and on one that is not; and what slopes estimated from the data are worth.
#include <algorithm>
#include <string>
#include <vector>

#include "forereach/residual/observations.h"
#include "identify/slopes.h"
#include "research/experiment.h"
#include "research/methods/affine.h"
#include "research/variants.h"

namespace forereach::research {
namespace {

const Method kAffine{"Affine residual", MakeAffine};

// With plans.
std::vector<Method> Families() { return {kAffine, Methods().front()}; }

const System* const kTargets[] = {&LinearPointMass(), &PointMassSystem()};

std::string TargetOf(const System& system) { return &system == &PointMassSystem() ? "knee target" : "linear target"; }

Cell TargetCell(const System& system, const Method& method) {
  Cell cell = PaperCell(system, system.sample_sizes.back(), system.noise_scale, 0);
  cell.method = method;
  return cell;
}

std::vector<Cell> AssumptionCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const System* system : kTargets)
    for (const Method& method : Families()) AddSeeds(scope, TargetCell(*system, method), cells);
  return cells;
}

// The part of true slopes, from the largest that data without corridor support show up to 1, where a declaration is
// wrong and passes the test.
double SilentBand(const System& system, int seed) {
  const Declaration truth{&system == &PointMassSystem() ? Eigen::MatrixXd(system.deployed / 1.5) : system.deployed,
                          Eigen::VectorXd::Zero(system.num_states())};
  const Transitions data = MakeData(system, Layout::kBelowKnee, seed, system.sample_sizes.back(), 0);
  const double seen = std::ranges::max(EstimateSlopes(SlopeEstimator::kLacki, truth, Observe(*system.model, data), 0));
  return std::max(0.0, 1 - seen);
}

std::vector<Table> AssumptionTables(const Results& results) {
  Table table{"Assumption families: affine and componentwise",
              "Point mass, N = 100, sub-Gaussian noise cut at sigma = 3 s. F: the declaration is refuted, for affine "
              "residuals because no (M, b) fits all observations, by linear programs. Silent band: noiseless data from "
              "below the knee; true slopes times a factor from this much below 1 are wrong and pass the pairwise test.",
              {}};
  const std::string why =
      "the linear pair and its data are not in the paper's text; without noise, two observations in the right "
      "direction show an affine residual's whole slope";
  for (const System* system : kTargets) {
    const std::string target = TargetOf(*system);
    for (const Method& method : Families()) {
      const Cell cell = TargetCell(*system, method);
      const std::string where = method.name + ", " + target + ": ";
      const std::string key = "affine." + std::string(system == kTargets[0] ? "linear." : "knee.");
      const bool is_affine = method.name == kAffine.name;
      const auto row = [&](const char* what, const char* figure, Group group, Statistic statistic) {
        table.Add(where + what, {Mark::kOurs, is_affine ? PaperOrNone(key + figure) : std::nullopt},
                  results.Mean(cell, group, statistic), 3, why);
      };
      row("F", "refuted", Group::kC, FalsifiedRate);
      row("B coverage", "B.coverage", Group::kB, Coverage);
      row("C coverage", "C.coverage", Group::kC, Coverage);
      row("C recall", "", Group::kC, Recall);
    }
    std::vector<std::optional<double>> bands;
    for (int seed = 0; seed < results.scope.seeds; ++seed) bands.push_back(SilentBand(*system, seed));
    table.Add(target + ": silent band", {Mark::kOurs, Paper(system == kTargets[0] ? "band.linear" : "band.knee")},
              EstimateOf(bands), 3, why);
  }
  table.Add("families of assumptions with plans", {Mark::kOurs, Paper("families")},
            static_cast<double>(Families().size()), 0,
            "the paper compares the other four in words; they have no plans here");
  return {table};
}

// ---- slopes

std::vector<Table> SlopeTables(const Results& results) {
  Table table{
      "Slope estimators",
      "Point mass, N = 100, noiseless data from below the knee, where the residual all but vanishes: the estimated "
      "factor on the deployed matrix, the largest over the coordinates. A factor below 0.667 is wrong."};
  const System& system = PointMassSystem();
  const Declaration declared{system.deployed, Eigen::VectorXd::Zero(system.num_states())};
  const std::pair<SlopeEstimator, const char*> estimators[] = {{SlopeEstimator::kLacki, "LACKI"},
                                                               {SlopeEstimator::kStrongin, "Strongin"},
                                                               {SlopeEstimator::kKnuthChou, "Knuth-Chou"}};
  for (const auto& [estimator, name] : estimators) {
    std::vector<std::optional<double>> factors;
    for (int seed = 0; seed < results.scope.seeds; ++seed) {
      const Transitions data = MakeData(system, Layout::kBelowKnee, seed, system.sample_sizes.back(), 0);
      factors.push_back(std::ranges::max(
          EstimateSlopes(estimator, declared, Observe(*system.model, data), static_cast<std::uint64_t>(seed))));
    }
    table.Add(name, {Mark::kOurs, Paper("slopes")}, EstimateOf(factors), 3,
              "the paper's residual is flat at every sample, the softplus not quite");
  }
  table.Add("factor for containment", {Mark::kOurs, Paper("slopes.containment")}, {}, 3,
            "not reproduced: the paper's plan, data and family are not in its text; `kept` has ours");
  return {table};
}

}  // namespace

Experiment AssumptionFamilies() {
  return {"assumptions", "affine residuals and declared slopes, true and false", AssumptionCells, AssumptionTables};
}

Experiment EstimatedSlopes() { return {"slopes", "slopes estimated from the data", {}, SlopeTables}; }

}  // namespace forereach::research
