// The effect of the declared L: too small, over parameter boxes, its norm compared with the whole dynamics', and the
// paper's certified matrices.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forereach/declare/slope_bound.h"
#include "forereach/dynamics/models/residuals.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/observations.h"
#include "research/equations_slopes.h"
#include "research/experiment.h"
#include "research/norm_ratio.h"
#include "research/paper_grids.h"

namespace forereach::research {
namespace {

// ---- incorrect

constexpr double kFactors[] = {1, 1 / 1.5, 0.5, 0.25, 0.1, 1 / 31.710};

// With data from below the knee.
Cell Scaled(const System& system, double factor) {
  Cell cell = PaperCell(system, system.sample_sizes.back(), 0, 0);
  cell.layout = Layout::kBelowKnee;
  if (factor != 1) cell.declared = {"deployed_times_" + fmt::format("{:.4g}", factor), factor * system.deployed};
  return cell;
}

std::vector<Cell> ScaledCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const System* system : Systems())
    for (const double factor : kFactors) AddSeeds(scope, Scaled(*system, factor), cells);
  return cells;
}

// In how many of the data sets of a scope two observations contradict the scaled declaration.
int Rejections(const Scope& scope, Layout layout, double factor) {
  int count = 0;
  for (const System* system : Systems())
    for (const int observations : scope.SizesOf(*system))
      for (const double noise : {0.0, system->noise_scale})
        for (int seed = 0; seed < scope.seeds; ++seed) {
          const Declaration declaration{factor * system->deployed,
                                        Eigen::VectorXd::Constant(system->num_states(), NoiseBound(noise))};
          const Transitions data = MakeData(*system, layout, seed, observations, noise);
          count += FindViolation(declaration, Observe(*system->model, data)).has_value();
        }
  return count;
}

std::vector<Table> TestTables(const Scope& scope) {
  Table table{
      "Incorrect declarations, pairwise test",
      "For the deployed matrix times each factor: the number of data sets that contradict it, over every N, channel "
      "and seed of both systems. Below the knee the residual is nearly zero, so data from there contradict no matrix."};
  for (const double factor : kFactors) {
    const std::string times = "L times " + fmt::format("{:.4g}", factor);
    table.Add(times + ": corridor",
              factor == 0.5 ? Reference(Mark::kOurs, Paper("incorrect.halved.rejections")) : Reference(),
              Rejections(scope, Layout::kCorridor, factor), 0,
              "the paper halves another bound, an underestimate that is not in its text");
    table.Add(times + ": below the knee", Rejections(scope, Layout::kBelowKnee, factor), 0);
  }
  table.Add("S under bounded noise, at step", {Mark::kOurs, Paper("incorrect.noisy.step")}, {}, 0,
            "not reproduced: the paper's plan, data and underestimate are not in its text; `kept` has ours");
  return {table};
}

std::vector<Table> IncorrectTables(const Results& results) {
  Table table{"Incorrect declarations, plans",
              "Data from below the knee, noiseless, the largest N; the same plans as above. The tubes show errors that "
              "the pairwise test cannot detect: a matrix that is too small gives tubes that the target leaves, and "
              "false certificates.",
              {}};
  for (const System* system : Systems())
    for (const double factor : kFactors) {
      const Cell cell = Scaled(*system, factor);
      const std::string where = system->name + ", L times " + fmt::format("{:.4g}", factor) + ": ";
      table.Add(where + "C coverage", results.Mean(cell, Group::kC, Coverage), 3);
      table.Add(where + "C certified", results.Mean(cell, Group::kC, CertificateRate), 3);
      table.Add(where + "false certificates, all groups", results.FalseCertificates(cell), 0);
    }
  std::vector<Table> tables = TestTables(results.scope);
  tables.push_back(table);
  return tables;
}

// ---- boxes

constexpr int kPercents[] = {5, 10, 20};

// Which parameters a box holds, and how the slopes over it are bounded; the paper does not say.
enum class Reading {
  kRoad,  // understeer, friction, gravity and gate temperature, by branch and bound
  kAll,   // time step and wheelbase, too
  kGrid   // wheelbase, understeer, friction and gate temperature, by the paper's grid: paper_grids.h
};
constexpr Reading kReadings[] = {Reading::kRoad, Reading::kAll, Reading::kGrid};

// One bit for each of HeadingSaturation's parameters, in their order.
using Parameters = unsigned;
constexpr Parameters kAllParameters = 0b111111, kRoadParameters = 0b111100, kGridParameters = 0b101110;

// Those of a set moved by a part of the paper's, up or down.
HeadingSaturation MovedBy(double part, Parameters moved) {
  HeadingSaturation residual{0.1, 2.5};
  double* const all[] = {&residual.dt,       &residual.wheelbase, &residual.understeer,
                         &residual.friction, &residual.gravity,   &residual.gate_temperature};
  for (std::size_t i = 0; i < std::size(all); ++i)
    if ((moved >> i & 1) != 0) *all[i] += part * *all[i];
  return residual;
}

Eigen::MatrixXd MatrixOf(const BicycleGrid& grid) {
  const System& bicycle = BicycleSystem();
  Eigen::MatrixXd lipschitz = Eigen::MatrixXd::Zero(bicycle.deployed.rows(), bicycle.deployed.cols());
  lipschitz(2, 3) = grid.by_speed;
  lipschitz(2, 5) = grid.by_steering;
  return lipschitz;
}

// A bound on the slopes of the bicycle's residual for all parameters of a set within some per cent of the paper's.
Eigen::MatrixXd BoundByBranches(Parameters moved, int percent) {
  const System& bicycle = BicycleSystem();
  const EquationsSlopes<HeadingSaturation> slopes;
  const auto low = MovedBy(-percent / 100.0, moved).parameters(), high = MovedBy(percent / 100.0, moved).parameters();
  std::vector<Interval> parameters;
  for (std::size_t i = 0; i < low.size(); ++i) parameters.push_back({low[i], high[i]});
  Eigen::MatrixXd lipschitz = Eigen::MatrixXd::Zero(bicycle.deployed.rows(), bicycle.deployed.cols());
  for (int k = 0; k < lipschitz.rows(); ++k)
    for (int l = 0; l < lipschitz.cols(); ++l)
      if (slopes.Occurs(k, l)) lipschitz(k, l) = BoundSlope(slopes, bicycle.domain, parameters, k, l).upper;
  return lipschitz;
}

Eigen::MatrixXd BoundAnew(Reading reading, int percent) {
  switch (reading) {
    case Reading::kRoad: return BoundByBranches(kRoadParameters, percent);
    case Reading::kAll: return BoundByBranches(kAllParameters, percent);
    case Reading::kGrid:
      return MatrixOf(
          PaperBicycleGrid(MovedBy(-percent / 100.0, kGridParameters), MovedBy(percent / 100.0, kGridParameters)));
  }
  throw std::invalid_argument("boxes: unknown reading");
}

// The same, bounded when it is first asked for. Not for several threads at once.
const Eigen::MatrixXd& BoundOverBox(Reading reading, int percent) {
  static std::map<std::pair<Reading, int>, Eigen::MatrixXd> known;
  const auto at = known.find({reading, percent});
  return at != known.end() ? at->second
                           : known.emplace(std::pair(reading, percent), BoundAnew(reading, percent)).first->second;
}

Cell BoxCell(Reading reading, int percent) {
  static constexpr const char* kNames[] = {"box_", "box_of_all_", "box_by_grid_"};
  const System& bicycle = BicycleSystem();
  Cell cell = PaperCell(bicycle, bicycle.sample_sizes.back(), 0, 0);
  cell.declared = {kNames[static_cast<std::size_t>(reading)] + std::to_string(percent) + "_percent",
                   BoundOverBox(reading, percent)};
  return cell;
}

std::vector<Cell> BoxCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const Reading reading : kReadings)
    for (const int percent : kPercents) AddSeeds(scope, BoxCell(reading, percent), cells);
  return cells;
}

// How many of the 63 sets of parameters have, on a coarse grid, each of the three slack ratios this near the paper's.
constexpr double kNearSlack = 0.02;

int SetsWithThePapersSlack() {
  int count = 0;
  const auto norm = [](double part, Parameters moved) {
    return MatrixOf(PaperBicycleGrid(MovedBy(-part, moved), MovedBy(part, moved), 25, 0.48, 1000, 500)).norm();
  };
  const double nominal = norm(0, 0);
  for (Parameters moved = 1; moved <= kAllParameters; ++moved)
    count += std::ranges::all_of(kPercents, [&](int percent) {
      const double paper = Paper("boxes." + std::to_string(percent) + ".slack").value;
      return std::abs(norm(percent / 100.0, moved) / nominal - paper) <= kNearSlack * paper;
    });
  return count;
}

// Title and parameters of each reading.
std::pair<const char*, const char*> WordsOf(Reading reading) {
  switch (reading) {
    case Reading::kRoad:
      return {"Parameter boxes", "understeer, friction, gravity and gate temperature in the box, by branch and bound"};
    case Reading::kAll:
      return {
          "Parameter boxes of all parameters",
          "understeer, friction, gravity, gate temperature, time step and wheelbase in the box, by branch and bound"};
    case Reading::kGrid:
      return {"Parameter boxes by the paper's grid",
              "understeer, friction, wheelbase and gate temperature in the box, by the paper's grid of `grids`, each "
              "factor of a derivative at its worst parameters as well as at its worst point of a cell"};
  }
  throw std::invalid_argument("boxes: unknown reading");
}

Table BoxTable(Reading reading, const Results& results) {
  const bool is_grid = reading == Reading::kGrid;
  const auto [title, held] = WordsOf(reading);
  Table table{title, std::string("Bicycle, N = 400, noiseless. L bounds the slopes for every ") + held +
                         ". Slack: the norm of L over the norm of the L for the nominal parameters. Joint: the part of "
                         "all plans with a complete tube that contains every rollout."};
  if (is_grid)
    table.about +=
        " These parameters were found among the 63 sets of the six by the paper's three slack ratios, so the ratios "
        "are fitted; the plans' figures had no part in it. Understeer and time step enter the derivatives by their "
        "product alone, friction and gravity too, so one may stand for the other.";
  const std::string why =
      is_grid ? "the slack is the paper's, so it splits L over its entries otherwise, or our fitted scenarios fail here"
              : "which parameters the paper's boxes hold, and how it bounds over them, is not in its text";
  const Eigen::MatrixXd& nominal = BoundOverBox(reading, 0);
  for (const int percent : kPercents) {
    const Cell cell = BoxCell(reading, percent);
    const std::string key = "boxes." + std::to_string(percent) + ".", where = std::to_string(percent) + " %: ";
    const auto row = [&](const char* what, const char* figure, const Estimate& ours, int decimals,
                         Mark mark = Mark::kOurs) {
      table.Add(where + what, {mark, PaperOrNone(key + figure)}, ours, decimals, why);
    };
    row("slack", "slack", cell.declared.matrix.norm() / nominal.norm(), 3, is_grid ? Mark::kFitted : Mark::kOurs);
    row("slack of the slope by v", "", cell.declared.matrix(2, 3) / nominal(2, 3), 3);
    row("slack of the slope by delta", "", cell.declared.matrix(2, 5) / nominal(2, 5), 3);
    row("C: recall", "recall", results.Mean(cell, Group::kC, Recall), 3);
    row("C: complete", "complete", results.Mean(cell, Group::kC, CompleteRate), 3);
    row("C: joint", "joint", results.Mean(cell, Group::kC, JointRate), 3);
    table.rows.back().follows = true;  // from complete, where coverage is one
    row("B: false certificates", "false_certificates", results.FalseCertificates(cell, Group::kB), 0);
  }
  if (is_grid)
    table.Add("sets of parameters, of 63, with each ratio within 2 % of the paper's, on 1000 by 500 cells",
              SetsWithThePapersSlack(), 0);
  return table;
}

std::vector<Table> BoxTables(const Results& results) {
  std::vector<Table> tables;
  for (const Reading reading : kReadings) tables.push_back(BoxTable(reading, results));
  return tables;
}

// ---- norms, grids: no plans

std::vector<Table> NormTables(const Results&) {
  Table table{
      "Norm ratios",
      "|L_f|_F / |L_r|_F: L_r is the deployed matrix over 1.5, L_f adds the largest |D_z f0| over the domain to it."};
  for (const System* system : Systems())
    table.Add(system->name, {Mark::kExact, Paper("norms." + system->name)}, NormRatio(*system, system->deployed / 1.5),
              3);
  return {table};
}

double RoundedUp(double x) { return std::ceil(x * 1e9) / 1e9; }

std::vector<Table> GridTables(const Results&) {
  const PointMassGrid point_mass = PaperPointMassGrid(VelocityKnee{0.15});
  const BicycleGrid bicycle = PaperBicycleGrid(HeadingSaturation{0.1, 2.5});
  const Eigen::MatrixXd &of_mass = PointMassSystem().deployed, &of_bicycle = BicycleSystem().deployed;
  struct Entry {
    const char *what, *key;
    double certified, deployed;
  };
  const Entry of_point_mass[] = {{"point mass, position diagonal", "position_diagonal", point_mass.position_diagonal,
                                  std::min(of_mass(0, 2), of_mass(1, 3))},
                                 {"point mass, position cross", "position_cross", point_mass.position_cross,
                                  std::min(of_mass(0, 3), of_mass(1, 2))},
                                 {"point mass, velocity diagonal", "velocity_diagonal", point_mass.velocity_diagonal,
                                  std::min(of_mass(2, 2), of_mass(3, 3))},
                                 {"point mass, velocity cross", "velocity_cross", point_mass.velocity_cross,
                                  std::min(of_mass(2, 3), of_mass(3, 2))}},
              of_heading[] = {{"bicycle, heading by v", "by_speed", bicycle.by_speed, of_bicycle(2, 3)},
                              {"bicycle, heading by delta", "by_steering", bicycle.by_steering, of_bicycle(2, 5)}};
  Table table{"Certified declarations",
              "L_cert by the paper's fixed grids, rounded upward to nine decimals, as the paper says that it rounds. "
              "It prints three of the point mass's entries rounded to nearest, below the value: a slip, which its "
              "margin does not have. Proved bounds, which are slightly lower, are in declare.md. Margin: the least "
              "difference of a deployed entry and a certified one."};
  const auto add = [&](std::span<const Entry> entries, const std::string& system, const char* name) {
    double margin = kInfinity;
    for (const auto& [what, key, certified, deployed] : entries) {
      const std::string of(key);
      table.Add(what, {Mark::kExact, Paper("grids." + of)}, RoundedUp(certified), 9,
                "the paper's slip: rounded to nearest, its text says upward");
      table.Add(std::string(what) + ", deployed", {Mark::kTaken, Paper("deployed." + of)}, deployed, 9);
      margin = std::min(margin, deployed - RoundedUp(certified));
    }
    table.Add(std::string(name) + ", margin", {Mark::kExact, Paper("margins." + system)}, margin, 9);
  };
  add(of_point_mass, "point_mass", "point mass");
  add(of_heading, "bicycle", "bicycle");
  return {table};
}

}  // namespace

Experiment IncorrectDeclarations() {
  return {"incorrect", "declarations that are too small", ScaledCells, IncorrectTables};
}

Experiment ParameterBoxes() { return {"boxes", "declarations over parameter boxes", BoxCells, BoxTables}; }

Experiment NormRatios() { return {"norms", "the whole dynamics' Lipschitz norm over the residual's", {}, NormTables}; }

Experiment CertifiedDeclarations() {
  return {"grids", "the paper's certified declarations by its own grids", {}, GridTables};
}

}  // namespace forereach::research
