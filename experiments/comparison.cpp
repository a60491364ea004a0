// ForeReach compared with the other methods: coverage without data near the plan, recall with data.
#include <cmath>
#include <map>
#include <string>

#include "experiments/experiment.h"

namespace forereach::experiments {
namespace {

Cell With(const Method& method, Cell cell) {
  cell.method = method;
  return cell;
}

// The sizes at which the paper shows every method.
std::vector<int> Sizes(const Scope& scope) { return scope.quick ? std::vector{25, 400} : std::vector{25, 100, 400}; }

std::vector<Cell> Cells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const Method& method : Methods()) {
    AddSeeds(scope, With(method, PaperCell(PointMassSystem(), 100, 0, 0)), cells);
    for (const int observations : Sizes(scope))
      AddSeeds(scope, With(method, PaperCell(BicycleSystem(), observations, 0, 0)), cells);
  }
  return cells;
}

// What of a method the paper does not fix; docs/experiments-methods.md has all of it.
std::string WhatIsOurs(const Method& method) {
  static const std::map<std::string, const char*> known{
      {"Global calibration", "level and center are ours: `readings`"},
      {"Regional calibration", "the reading is ours: `readings`"},
      {"Plug-in Gaussian", "the reading is ours: `readings`"},
      {"GP (k=2)", "kernel, fit and the points of a query are ours"},
      {"GP (k=3)", "kernel, fit and the points of a query are ours"},
      {"Alanwar Alg. 6", "ours covers the whole domain, so no tube is complete"},
      {"CP-SLS-MPC equations", "weights and drift rate are ours"}};
  const auto at = known.find(method.name);
  return at == known.end() ? "" : at->second;
}

// The readings of these two were chosen by their figures: readings.cpp has those that were not.
Mark MarkOf(const Method& method) {
  const bool is_chosen = method.name == "Regional calibration" || method.name == "Plug-in Gaussian";
  return is_chosen ? Mark::kFitted : Mark::kOurs;
}

// Where a method falls: a tube that misses the target without data is unsound, one that certifies nothing with data
// is of no use.
const char* Side(std::optional<double> coverage, std::optional<double> recall) {
  if (coverage && *coverage < 1 && recall && *recall > 0) return "unsound";
  return recall && *recall > 0 ? "sound and informative" : "uninformative";
}

std::vector<Table> Tables(const Scope& scope, const Results& results) {
  Table bicycle{"Methods, bicycle",
                "Noiseless. Coverage is the part of the complete tubes that contain every rollout; a method that "
                "completes no tube has no entry. The methods differ only in their bound on the residual; the tube "
                "comes from the same propagation.",
                {}};
  Table point_mass{"Methods, point mass", "Noiseless, N = 100.", {}};
  for (const Method& method : Methods()) {
    const bool is_fore_reach = &method == &Methods().front();
    for (const int observations : Sizes(scope)) {
      const Cell cell = With(method, PaperCell(BicycleSystem(), observations, 0, 0));
      const std::string n = std::to_string(observations), where = method.name + ", N = " + n + ": ";
      const auto paper = [&](const std::string& group, const std::string& figure) {
        return PaperOrNone(is_fore_reach ? "bicycle." + group + "." + figure + "." + n
                                         : method.name + "." + n + "." + group + "." + figure);
      };
      const auto row = [&](const char* what, const Reference& reference, Group group, Statistic statistic) {
        bicycle.rows.push_back(
            {where + what, reference, OverSeeds(scope, results, cell, group, statistic), 4, WhatIsOurs(method)});
        return bicycle.rows.back().ours.mean;
      };
      const auto coverage = paper("B", "coverage"), recall = paper("C", "recall");
      const auto our_coverage = row("B coverage", {MarkOf(method), coverage}, Group::kB, Coverage);
      const auto our_recall = row("C recall", {is_fore_reach ? Mark::kFitted : MarkOf(method), recall}, Group::kC, Recall);
      row("B certified", {}, Group::kB, CertificateRate);
      row("B false-safe", {}, Group::kB, FalseSafeRate);
      if (observations == Sizes(scope).back())
        bicycle.about += "\n- " + method.name + ", N = " + n + ": " + Side(our_coverage, our_recall) +
                         (coverage ? std::string("; the paper's: ") + Side(coverage->value, recall->value) : "") + ".";
    }
    const Cell cell = With(method, PaperCell(PointMassSystem(), 100, 0, 0));
    const auto row = [&](const char* what, const char* key, Group group, Statistic statistic) {
      point_mass.rows.push_back({method.name + ": " + what,
                                 {Mark::kOurs, PaperOrNone("point_mass." + method.name + "." + key)},
                                 OverSeeds(scope, results, cell, group, statistic),
                                 3,
                                 WhatIsOurs(method)});
    };
    row("B coverage", "B.coverage", Group::kB, Coverage);
    row("B certified", "B.certified", Group::kB, CertificateRate);
    row("B false-safe", "B.false_safe", Group::kB, FalseSafeRate);
    row("C recall", "C.recall", Group::kC, Recall);
  }
  return {bicycle, point_mass};
}

std::vector<Plot> Plots(const Scope& scope, const Results& results) {
  static constexpr const char* kColors[] = {"green",  "blue", "sky",       "orange",   "'#F0A3C8'",
                                            "purple", "grey", "'#333333'", "'#b8b8b8'"};
  std::string data, lines, useless;
  for (std::size_t m = 0; m < Methods().size(); ++m) {
    const Method& method = Methods()[m];
    std::string points;
    double recall = 0;
    for (const int observations : Sizes(scope)) {
      const Cell cell = With(method, PaperCell(BicycleSystem(), observations, 0, 0));
      recall = OverSeeds(scope, results, cell, Group::kC, Recall).mean.value_or(0);
      // Without a complete tube there is no coverage; such a method is shown at 1.
      points += DataLine({OverSeeds(scope, results, cell, Group::kB, Coverage).mean.value_or(1), recall,
                          0.6 + 0.2 * std::log2(observations / 25.0)});
    }
    if (recall == 0) useless += (useless.empty() ? "" : ", ") + method.name;
    const std::string name = std::string(1, 'm').append(std::to_string(m)), color = kColors[m % std::size(kColors)];
    data += DataBlock(name, points);
    lines += std::string(m == 0 ? "plot " : ", ") + "$" + name + " using 1:2 with lines lw 1.2 lc rgb " + color +
             " notitle, '' using 1:2:3 with points ps variable pt " + (m == 0 ? "3" : "7") + " lw 2 lc rgb " + color +
             " title \"" + method.name + "\"";
  }
  return {{"methods",
           "Bicycle, by method: coverage of complete tubes in group B, which has no data, against recall in group C, "
           "which has data. A larger mark means more observations. A method that completes no tube is plotted at "
           "coverage 1. Only the upper right corner is both sound and informative.",
           840, 480,
           data +
               "set xrange [-0.03:1.04]; set yrange [-0.04:1.05]\n"
               "set xlabel 'coverage, group B'; set ylabel 'certified recall, group C'\n"
               "set key outside right top\nset label 'certify nothing: " +
               useless + "' at 0.97, 0.04 right font ',11'\n" + lines + "\n"}};
}

}  // namespace

Experiment Comparison() {
  return {"methods", "every method: coverage without data, recall with them", Cells, Tables, Plots};
}

}  // namespace forereach::experiments
