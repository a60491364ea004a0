// What of the other methods the paper leaves open: each reading of it that was tried, with coverage and recall.
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "research/experiment.h"
#include "research/methods/calibration.h"
#include "research/methods/gaussian_process.h"
#include "research/methods/plug_in_gaussian.h"
#include "research/variants.h"

namespace forereach::research {
namespace {

constexpr int kPlans = 40;  // the first of each group and seed

// The methods of one table, and the one of the paper's rows that they are readings of.
struct Family {
  std::string title, about, of;
  std::vector<Method> methods;
};

const char* NameOf(Center center) { return center == Center::kMean ? "around the mean" : "around zero"; }

std::string Named(const char* what, double value, Center center) {
  return fmt::format("{} {:.4g}, {}", what, value, NameOf(center));
}

Family GlobalReadings() {
  Family family{"Readings of global calibration",
                "The conformal quantile at several levels, around the mean of the residuals and around zero.",
                "Global calibration",
                {}};
  for (const Center center : {Center::kMean, Center::kZero})
    for (const double level : {0.05, 0.1, 0.2, 0.3, 0.4, 0.5}) {
      const CalibrationOptions options{level, center};
      family.methods.push_back({Named("Global, level", level, center),
                                [options](const Setting& setting) { return MakeGlobalCalibration(setting, options); }});
    }
  return family;
}

Family RegionalReadings() {
  Family family{
      "Readings of regional calibration",
      "Level 0.10; cells: the domain cut in four along the steering angle or along speed and steering angle, in two "
      "along every coordinate of state and input. \"Jointly\": the level is shared out among the cells that have "
      "observations. Elsewhere, where no cell was calibrated: the global box, the nearest cells', the widest of all, "
      "ForeReach's envelope, or no bound. Group B is elsewhere for all but the last cut.",
      "Regional calibration",
      {}};
  const auto add = [&](const std::string& name, const RegionalOptions& options) {
    family.methods.push_back({"Regional, " + name, [options](const Setting& setting) {
                                return std::make_unique<RegionalCalibration>(setting, options);
                              }});
  };
  const std::pair<Elsewhere, const char*> rules[] = {{Elsewhere::kGlobal, "global"},
                                                     {Elsewhere::kNearest, "nearest"},
                                                     {Elsewhere::kWidest, "widest"},
                                                     {Elsewhere::kDeclared, "declared"},
                                                     {Elsewhere::kUnbounded, "unbounded"}};
  for (const Center center : {Center::kMean, Center::kZero})
    for (const auto& [rule, name] : rules)
      add(std::string("speed and steering, ") + NameOf(center) + ", elsewhere " + name,
          {.global = {0.1, center}, .regional = {0.1, center}, .elsewhere = rule});
  for (const Center center : {Center::kMean, Center::kZero})
    add(std::string("steering, ") + NameOf(center) + ", elsewhere widest",
        {.global = {0.1, center}, .regional = {0.1, center}, .cut = Cut::kSteepest, .elsewhere = Elsewhere::kWidest});
  for (const Center center : {Center::kMean, Center::kZero})
    add(std::string("steering, ") + NameOf(center) + ", elsewhere widest, jointly",
        {.regional = {0.1, center}, .jointly = true, .cut = Cut::kSteepest, .elsewhere = Elsewhere::kWidest});
  add("steering, around zero, elsewhere global, jointly",
      {.global = {0.1, Center::kZero}, .regional = {0.1, Center::kZero}, .jointly = true, .cut = Cut::kSteepest});
  add("state and input, around the mean, elsewhere global", {.cut = Cut::kAll, .cells = 2});
  return family;
}

Family GaussianReadings() {
  Family family{"Readings of the plug-in Gaussian",
                "So many sample deviations, around the mean of the residuals and around zero. 1.645 is two-sided 0.10.",
                "Plug-in Gaussian",
                {}};
  for (const Center center : {Center::kMean, Center::kZero})
    for (const double deviations : {1.0, 1.645, 2.0, 3.0})
      family.methods.push_back({Named("Plug-in, deviations", deviations, center), [=](const Setting& setting) {
                                  return MakePlugInGaussian(setting, deviations, center);
                                }});
  return family;
}

Family ProcessReadings(int deviations) {
  const std::string of = "GP (k=" + std::to_string(deviations) + ")";
  Family family{"Readings of " + of, "The band at the center of a query alone, or at its corners, too.", of, {}};
  for (const bool corners : {false, true})
    family.methods.push_back({of + (corners ? ", corners" : ", center"), [=](const Setting& setting) {
                                return std::make_unique<GaussianProcessBand>(setting, deviations, corners);
                              }});
  return family;
}

const std::vector<Family>& Families() {
  static const std::vector<Family> all{GlobalReadings(), RegionalReadings(), GaussianReadings(), ProcessReadings(2),
                                       ProcessReadings(3)};
  return all;
}

constexpr int kSizes[] = {25, 400};

Cell ReadingCell(const Method& method, int observations) {
  Cell cell = PaperCell(WithFewerPlans(BicycleSystem(), kPlans), observations, 0, 0);
  cell.method = method;
  return cell;
}

std::vector<Cell> Cells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const Family& family : Families())
    for (const Method& method : family.methods)
      for (const int observations : kSizes) AddSeeds(scope, ReadingCell(method, observations), cells);
  return cells;
}

Table TableOf(const Family& family, const Results& results) {
  Table table{family.title, family.about + " The paper's figures, for comparison:"};
  for (const Method& method : family.methods) {
    double squares = 0;
    int count = 0;
    std::vector<Row> rows;
    for (const int observations : kSizes) {
      const std::string n = std::to_string(observations);
      const auto row = [&](const char* what, Group group, const char* key, Statistic statistic) {
        const Estimate ours = results.Mean(ReadingCell(method, observations), group, statistic);
        const double paper = Paper(family.of + "." + n + "." + key).value;
        if (&method == &family.methods.front())
          table.about +=
              std::string(rows.empty() ? " " : ", ") + what + " " + fmt::format("{:.3f}", paper) + " at N = " + n;
        if (ours.mean) squares += (*ours.mean - paper) * (*ours.mean - paper), ++count;
        rows.push_back({method.name + ", N = " + n + ": " + what, {}, ours, 3, ""});
      };
      row("B coverage", Group::kB, "B.coverage", Coverage);
      row("C recall", Group::kC, "C.recall", Recall);
    }
    table.rows.insert(table.rows.end(), rows.begin(), rows.end());
    table.Add(method.name + ": root mean square distance to those of the paper's that it has",
              std::sqrt(squares / count), 3);
  }
  table.about += ". " + std::to_string(kPlans) + " plans a group and seed. None of these readings is the paper's own.";
  return table;
}

std::vector<Table> Tables(const Results& results) {
  std::vector<Table> tables;
  for (const Family& family : Families()) tables.push_back(TableOf(family, results));
  return tables;
}

}  // namespace

Experiment Readings() {
  return {"readings", "what of the other methods the paper leaves open: every reading tried", Cells, Tables};
}

}  // namespace forereach::research
