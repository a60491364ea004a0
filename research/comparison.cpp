// ForeReach compared with the other methods: coverage without data near the plan, recall with data.
#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "research/experiment.h"
#include "research/methods_plot.h"
#include "research/sides.h"

namespace forereach::research {
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

// What of a method the paper does not fix; research/methods.md has all of it.
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

// At N = 25 no cell has a bound of its own, and the paper's figures are the global ones, too.
bool IsGlobalByAnotherName(const Method& method, int observations) {
  return method.name == "Regional calibration" && observations == 25;
}

Point OurPoint(const Results& results, const Cell& cell) {
  return {results.Mean(cell, Group::kB, Coverage).mean, results.Mean(cell, Group::kC, Recall).mean};
}

// The paper's figure of the bicycle, where it has one.
std::optional<PaperValue> PaperOf(const Method& method, int observations, const std::string& group,
                                  const std::string& figure) {
  const std::string n = std::to_string(observations);
  return PaperOrNone(&method == &Methods().front() ? "bicycle." + group + "." + figure + "." + n
                                                   : method.name + "." + n + "." + group + "." + figure);
}

std::string InWords(const Point& point) {
  const auto text = [](std::optional<double> value) { return value ? fmt::format("{:.3f}", *value) : "none"; };
  return SideOf(point) + " (" + text(point.coverage) + ", " + text(point.recall) + ")";
}

// Every method and N by its side, and whether the paper's point is reproduced.
std::string Sides(const Results& results) {
  int reproduced = 0, all = 0;
  std::string lines;
  for (const Method& method : Methods())
    for (const int observations : Sizes(results.scope)) {
      const Point ours = OurPoint(results, With(method, PaperCell(BicycleSystem(), observations, 0, 0)));
      lines.append("\n- ").append(method.name).append(", N = ").append(std::to_string(observations)).append(": ");
      lines += InWords(ours);
      const auto coverage = PaperOf(method, observations, "B", "coverage"),
                 recall = PaperOf(method, observations, "C", "recall");
      if (coverage && recall) {
        const Point paper{coverage->value, recall->value};
        const bool is_so = IsReproduced(ours, paper);
        lines += "; the paper's: " + InWords(paper) + (is_so ? ": reproduced" : ": **not reproduced**");
        if (is_so && MarkOf(method) == Mark::kFitted) lines += ", by a reading that was chosen for it";
        if (is_so && &method == &Methods().front()) lines += ", its recall by the fit of the scenarios";
        reproduced += is_so, ++all;
      }
      lines += ".";
    }
  return fmt::format(
      "Unsound: coverage below {:g}. Uninformative: recall at most {:g}. Reproduced: on the paper's side, and coverage "
      "and recall both within {:g} of the paper's. These are words for measured figures, as in the paper: only "
      "ForeReach, Alanwar Alg. 6 and the scalar envelope are sound by a theorem, if the declaration holds. Of the {} "
      "points of the paper {} are reproduced. In brackets coverage and recall:\n{}",
      1 - kSideBand, kSideBand, kPointBand, all, reproduced, lines);
}

std::vector<Table> Tables(const Results& results) {
  Table bicycle{"Methods, bicycle",
                "Noiseless. Coverage is the part of the complete tubes that contain every rollout; a method that "
                "completes no tube has no entry. The methods differ only in their bound on the residual; the tube "
                "comes from the same propagation.\n\n" +
                    Sides(results),
                {}};
  Table point_mass{"Methods, point mass", "Noiseless, N = 100."};
  for (const Method& method : Methods()) {
    const bool is_fore_reach = &method == &Methods().front();
    for (const int observations : Sizes(results.scope)) {
      const Cell cell = With(method, PaperCell(BicycleSystem(), observations, 0, 0));
      const std::string n = std::to_string(observations), where = method.name + ", N = " + n + ": ";
      const auto row = [&](const char* what, const Reference& reference, Group group, Statistic statistic) {
        bicycle.Add(where + what, reference, results.Mean(cell, group, statistic), 4, WhatIsOurs(method),
                    IsGlobalByAnotherName(method, observations));
      };
      row("B coverage", {MarkOf(method), PaperOf(method, observations, "B", "coverage")}, Group::kB, Coverage);
      row("C recall", {is_fore_reach ? Mark::kFitted : MarkOf(method), PaperOf(method, observations, "C", "recall")},
          Group::kC, Recall);
      row("B certified", {}, Group::kB, CertificateRate);
      row("B false-safe", {}, Group::kB, FalseSafeRate);
    }
    const Cell cell = With(method, PaperCell(PointMassSystem(), 100, 0, 0));
    const auto row = [&](const char* what, const char* key, Group group, Statistic statistic) {
      point_mass.Add(method.name + ": " + what, {Mark::kOurs, PaperOrNone("point_mass." + method.name + "." + key)},
                     results.Mean(cell, group, statistic), 3, WhatIsOurs(method));
    };
    row("B coverage", "B.coverage", Group::kB, Coverage);
    row("B certified", "B.certified", Group::kB, CertificateRate);
    row("B false-safe", "B.false_safe", Group::kB, FalseSafeRate);
    row("C recall", "C.recall", Group::kC, Recall);
  }
  return {bicycle, point_mass};
}

Estimate AsEstimate(const PaperValue& value) { return {value.value, std::max(value.deviation, 0.0), 1}; }

std::vector<Plot> Plots(const Results& results) {
  std::vector<MethodMarks> all;
  for (const Method& method : Methods()) {
    const auto ours = [&](const Cell& cell, int observations) {
      return MethodMark{observations, results.Mean(With(method, cell), Group::kB, Coverage),
                        results.Mean(With(method, cell), Group::kC, Recall)};
    };
    MethodMarks marks{method.name, {}, {}, {}, {}};
    for (const int observations : Sizes(results.scope)) {
      marks.bicycle.push_back(ours(PaperCell(BicycleSystem(), observations, 0, 0), observations));
      const auto coverage = PaperOf(method, observations, "B", "coverage"),
                 recall = PaperOf(method, observations, "C", "recall");
      if (coverage && recall)
        marks.papers_bicycle.push_back({observations, AsEstimate(*coverage), AsEstimate(*recall)});
    }
    marks.point_mass = {ours(PaperCell(PointMassSystem(), 100, 0, 0), 100)};
    if (&method == &Methods().front())
      marks.papers_point_mass = {
          {100, AsEstimate(Paper("point_mass.B.coverage")), AsEstimate(Paper("point_mass.C.recall"))}};
    all.push_back(std::move(marks));
  }
  return {MethodsPlot(all)};
}

}  // namespace

Experiment Comparison() {
  return {"methods", "every method: coverage without data, recall with them", Cells, Tables, Plots};
}

}  // namespace forereach::research
