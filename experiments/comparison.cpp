// ForeReach compared with the other methods: coverage without data near the plan, recall with data.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>

#include "experiments/experiment.h"
#include "experiments/sides.h"

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

// At N = 25 no cell has a bound of its own, and the paper's figures are the global ones, too.
bool IsGlobalByAnotherName(const Method& method, int observations) {
  return method.name == "Regional calibration" && observations == 25;
}

Point OurPoint(const Scope& scope, const Results& results, const Cell& cell) {
  return {OverSeeds(scope, results, cell, Group::kB, Coverage).mean,
          OverSeeds(scope, results, cell, Group::kC, Recall).mean};
}

// The paper's figure of the bicycle, where it has one.
std::optional<PaperValue> PaperOf(const Method& method, int observations, const std::string& group,
                                  const std::string& figure) {
  const std::string n = std::to_string(observations);
  return PaperOrNone(&method == &Methods().front() ? "bicycle." + group + "." + figure + "." + n
                                                   : method.name + "." + n + "." + group + "." + figure);
}

std::string InWords(const Point& point) {
  const auto text = [](std::optional<double> value) {
    char number[16];
    std::snprintf(number, sizeof number, "%.3f", value.value_or(0));
    return std::string(value ? number : "none");
  };
  return SideOf(point) + " (" + text(point.coverage) + ", " + text(point.recall) + ")";
}

// Every method and N by its side, and whether the paper's point is reproduced.
std::string Sides(const Scope& scope, const Results& results) {
  int reproduced = 0, all = 0;
  std::string lines;
  for (const Method& method : Methods())
    for (const int observations : Sizes(scope)) {
      const Point ours = OurPoint(scope, results, With(method, PaperCell(BicycleSystem(), observations, 0, 0)));
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
  char bands[640];
  std::snprintf(
      bands, sizeof bands,
      "Unsound: coverage below %g. Uninformative: recall at most %g. Reproduced: on the paper's side, and coverage "
      "and recall both within %g of the paper's. These are words for measured figures, as in the paper: only "
      "ForeReach, "
      "Alanwar Alg. 6 and the scalar envelope are sound by a theorem, if the declaration holds. ",
      1 - kSideBand, kSideBand, kPointBand);
  return bands + ("Of the " + std::to_string(all) + " points of the paper " + std::to_string(reproduced)) +
         " are reproduced. In brackets coverage and recall:\n" + lines;
}

std::vector<Table> Tables(const Scope& scope, const Results& results) {
  Table bicycle{"Methods, bicycle",
                "Noiseless. Coverage is the part of the complete tubes that contain every rollout; a method that "
                "completes no tube has no entry. The methods differ only in their bound on the residual; the tube "
                "comes from the same propagation.\n\n" +
                    Sides(scope, results),
                {}};
  Table point_mass{"Methods, point mass", "Noiseless, N = 100.", {}};
  for (const Method& method : Methods()) {
    const bool is_fore_reach = &method == &Methods().front();
    for (const int observations : Sizes(scope)) {
      const Cell cell = With(method, PaperCell(BicycleSystem(), observations, 0, 0));
      const std::string n = std::to_string(observations), where = method.name + ", N = " + n + ": ";
      const auto row = [&](const char* what, const Reference& reference, Group group, Statistic statistic) {
        bicycle.rows.push_back({where + what, reference, OverSeeds(scope, results, cell, group, statistic), 4,
                                WhatIsOurs(method), IsGlobalByAnotherName(method, observations)});
      };
      row("B coverage", {MarkOf(method), PaperOf(method, observations, "B", "coverage")}, Group::kB, Coverage);
      row("C recall", {is_fore_reach ? Mark::kFitted : MarkOf(method), PaperOf(method, observations, "C", "recall")},
          Group::kC, Recall);
      row("B certified", {}, Group::kB, CertificateRate);
      row("B false-safe", {}, Group::kB, FalseSafeRate);
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

// "x dx y dy" of a point in the picture; what completes no tube has a place of its own, beyond 1.
constexpr double kFirstPlaceOfNone = 1.09, kPlaceOfNone = 0.035;

std::string PointLine(int observations, const Estimate& coverage, const Estimate& recall, std::size_t none) {
  const double place = kFirstPlaceOfNone + kPlaceOfNone * static_cast<double>(none);
  return DataLine({static_cast<double>(observations), coverage.mean.value_or(place), coverage.deviation,
                   recall.mean.value_or(NAN), recall.deviation});
}

// "x y "N"" of a point that has a coverage; one line for successive points that labels of their own would cover.
class Labels final {
 public:
  void Add(int observations, const Estimate& coverage, const Estimate& recall) {
    if (!coverage.mean || !recall.mean) return;
    const std::string n = std::to_string(observations);
    if (!text_.empty() && std::abs(*coverage.mean - x_) < kTogether && std::abs(*recall.mean - y_) < kTogether) {
      text_ += ", " + n;
      return;
    }
    End();
    x_ = *coverage.mean, y_ = *recall.mean, text_ = n;
  }
  [[nodiscard]] std::string Lines() {
    End();
    return lines_;
  }

 private:
  static constexpr double kTogether = 0.06;

  void End() {
    if (text_.empty()) return;
    lines_ += DataLine({x_, y_});
    lines_.back() = ' ';
    lines_ += "\"" + text_ + "\"\n";
    text_.clear();
  }

  double x_ = 0, y_ = 0;
  std::string text_, lines_;
};

Estimate AsEstimate(const std::optional<PaperValue>& value) {
  if (!value) return {};
  return {value->value, std::max(value->deviation, 0.0), 1};
}

std::vector<Plot> Plots(const Scope& scope, const Results& results) {
  static constexpr const char* kColors[] = {"green",  "blue",      "sky",       "orange",   "red",
                                            "purple", "'#222222'", "'#8b5a2b'", "'#a0a000'"};
  std::string data, bicycle, point_mass;
  std::size_t none = 0;
  for (std::size_t m = 0; m < Methods().size(); ++m) {
    const Method& method = Methods()[m];
    const auto at = [&](const Cell& cell, Group group, Statistic statistic) {
      return OverSeeds(scope, results, With(method, cell), group, statistic);
    };
    std::string ours, papers;
    Labels labels;
    bool completes = true;
    for (const int observations : Sizes(scope)) {
      const Cell cell = PaperCell(BicycleSystem(), observations, 0, 0);
      const Estimate coverage = at(cell, Group::kB, Coverage), recall = at(cell, Group::kC, Recall);
      completes = completes && coverage.mean;
      ours += PointLine(observations, coverage, recall, none);
      labels.Add(observations, coverage, recall);
      if (const auto paper = PaperOf(method, observations, "B", "coverage"))
        papers +=
            PointLine(observations, AsEstimate(paper), AsEstimate(PaperOf(method, observations, "C", "recall")), 0);
    }
    const Cell cell = PaperCell(PointMassSystem(), 100, 0, 0);
    const std::string own = PointLine(100, at(cell, Group::kB, Coverage), at(cell, Group::kC, Recall), none);
    none += !completes;
    const std::string name = std::string(1, 'm').append(std::to_string(m)), color = kColors[m % std::size(kColors)];
    const std::string label_lines = labels.Lines();
    data += DataBlock(name, ours) + DataBlock(name + "p", own);
    const std::string mark = m == 0 ? "pt 3 ps 1.4" : "pt 7 ps 0.8";
    const auto series = [&](const std::string& block, bool titled) {
      return "$" + block + " using 2:4:3:5 with xyerrorbars " + mark + " lw 1 lc rgb " + color +
             (titled ? " title \"" + method.name + "\"" : " notitle") + ", ";
    };
    bicycle += series(name, false) + "'' using ($2 <= 1 ? $2 : 1/0):4 with lines lw 1 lc rgb " + color + " notitle, ";
    if (!label_lines.empty()) {
      data += DataBlock(name + "labels", label_lines);
      bicycle += "$" + name + "labels using 1:2:3 with labels left offset 0.6," + (m % 2 == 0 ? "0.6" : "-0.7") +
                 " font ',9' textcolor rgb " + color + " notitle, ";
    }
    point_mass += series(name + "p", true);
    if (papers.empty()) continue;
    data += DataBlock(name + "paper", papers);
    bicycle += "$" + name + "paper using 2:4:3:5 with xyerrorbars pt 6 ps 1.1 lw 0.7 dt 3 lc rgb " + color +
               " notitle, '' using 2:4 with lines lw 0.7 dt 3 lc rgb " + color + " notitle, ";
  }
  const std::string paper_name = "fore_reach_paper";
  data += DataBlock(paper_name, PointLine(100, AsEstimate(Paper("point_mass.B.coverage")),
                                          AsEstimate(Paper("point_mass.C.recall")), 0));
  return {
      {"methods",
       "Coverage of complete tubes in group B, which has no data, against recall in group C, which has. Filled: ours, "
       "with one standard deviation over the seeds and, for the bicycle, N = 25, 100, 400 beside the mark; at N = 25 "
       "regional calibration is the global one. Hollow and dotted: the paper's; of the point mass it prints both "
       "figures for ForeReach only. A method that completes no tube in B has no coverage and stands in the strip on "
       "the "
       "right, side by side with the others.",
       1240, 560,
       data +
           "set multiplot layout 1,2\nset xrange [-0.04:1.24]; set yrange [-0.04:1.08]\n"
           "set xtics ('0' 0, '0.2' 0.2, '0.4' 0.4, '0.6' 0.6, '0.8' 0.8, '1' 1, 'none' 1.14)\n"
           "set arrow from 1.05, graph 0 to 1.05, graph 1 nohead dt 2 lc rgb grey\n"
           "set xlabel 'coverage, group B'; set ylabel 'certified recall, group C'\n"
           "set lmargin at screen 0.065; set rmargin at screen 0.40; set title 'Bicycle'\nunset key\nplot " +
           bicycle +
           "1/0 notitle\nset lmargin at screen 0.47; set rmargin at screen 0.79; set title 'Point mass, N = 100'\n"
           "set key at screen 0.998, 0.9 right top\nplot " +
           point_mass + "$" + paper_name +
           " using 2:4 with points pt 6 ps 1.4 lc rgb green title 'the paper (hollow, dotted)'\nunset multiplot\n"}};
}

}  // namespace

Experiment Comparison() {
  return {"methods", "every method: coverage without data, recall with them", Cells, Tables, Plots};
}

}  // namespace forereach::experiments
