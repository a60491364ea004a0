// ForeReach beside the other methods: coverage where there are no data, recall where there are.
#include <algorithm>
#include <string>

#include "experiments/experiment.h"
#include "experiments/paper_values.h"

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

std::optional<PaperValue> PaperOrNone(const std::string& key) {
  const bool known = std::ranges::find(kPaperValues, key, &PaperValue::key) != std::end(kPaperValues);
  return known ? std::optional(Paper(key)) : std::nullopt;
}

std::vector<Table> Tables(const Scope& scope, const Results& results) {
  Table bicycle{
      "Methods, bicycle",
      "Noiseless. Coverage is of complete tubes: a method without one has none. Methods differ in their bound "
      "of the residual alone; the tube is made by the same propagation.",
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
      const auto row = [&](const char* what, std::optional<PaperValue> value, Group group, Statistic statistic) {
        bicycle.rows.push_back({where + what, value, OverSeeds(scope, results, cell, group, statistic), 4, ""});
      };
      row("B coverage", paper("B", "coverage"), Group::kB, Coverage);
      row("C recall", paper("C", "recall"), Group::kC, Recall);
      row("B certified", {}, Group::kB, CertificateRate);
      row("B false-safe", {}, Group::kB, FalseSafeRate);
    }
    const Cell cell = With(method, PaperCell(PointMassSystem(), 100, 0, 0));
    const auto row = [&](const char* what, const char* key, Group group, Statistic statistic) {
      point_mass.rows.push_back({method.name + ": " + what, PaperOrNone("point_mass." + method.name + "." + key),
                                 OverSeeds(scope, results, cell, group, statistic), 3, ""});
    };
    row("B coverage", "B.coverage", Group::kB, Coverage);
    row("B certified", "B.certified", Group::kB, CertificateRate);
    row("B false-safe", "B.false_safe", Group::kB, FalseSafeRate);
    row("C recall", "C.recall", Group::kC, Recall);
  }
  return {bicycle, point_mass};
}

}  // namespace

Experiment Comparison() { return {"methods", "every method: coverage without data, recall with them", Cells, Tables}; }

}  // namespace forereach::experiments
