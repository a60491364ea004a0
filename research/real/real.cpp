#include "research/real/real.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>

#include "research/plot.h"
#include "research/real/study.h"
#include "research/run_directory.h"
#include "task/config.h"
#include "task/config_error.h"

namespace forereach::research {
namespace {

namespace fs = std::filesystem;

// What is tried, and what of it in a quick look.
struct Grid {
  std::vector<double> quantiles{0.9, 0.95, 0.98, 0.985, 0.99, 0.995, 1}, slope_quantiles{0.9, 0.98, 0.995},
      factors{1, 1.5, 2};
  std::vector<int> sizes{50, 100, 200, 400};
  std::vector<double> changes{0.1, 0.2, 0.3, 0.5}, change_quantiles{0.985, 1};
};
const Grid kWhole, kQuick{{0.9, 0.985, 1}, {0.995}, {1, 2}, {100}, {0.2}, {1}};

constexpr int kShort = 5, kLong = 10;  // steps of a window
constexpr double kGentle = 0.3;        // change of steering from step to step, where each way is shown by itself
constexpr double kChosen = 0.985;      // the quantile of the tables that vary something else, and of the task

std::string Text(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}
std::string Text(const char* format, std::optional<double> value) { return value ? Text(format, *value) : "none"; }
std::string Percent(int part, int whole) { return whole > 0 ? Text("%.2f", 100.0 * part / whole) : "none"; }

// ---- trials

struct Trial {
  std::string table, learned_from, judged_by;
  LearnOptions options;
  double factor;    // on the slopes
  Learned learned;  // from the first part, if there are two
  Judgement judged;
};

// What a trial shows, in the order of the CSV's columns.
struct Field {
  const char* name;
  std::string (*text)(const Trial&);
};

template <std::size_t corridor>
std::string CertifiedIn(const Trial& trial) {
  return Percent(trial.judged.certified(corridor), static_cast<int>(trial.judged.windows.size()));
}
template <int k>
std::string Disturbance(const Trial& trial) {
  return Text("%.4g", trial.learned.problem->declaration.disturbance[k]);
}

const Field kLearnedFrom{"learned from", [](const Trial&t) { return t.learned_from; }},
    kJudgedBy{"judged by", [](const Trial&t) { return t.judged_by; }},
    kCount{"N", [](const Trial&t) { return std::to_string(t.learned.transitions); }},
    kQuantile{"quantile", [](const Trial&t) { return Text("%.4g", t.options.quantile); }},
    kFactor{"factor on L", [](const Trial&t) { return t.options.slopes ? Text("%g", t.factor) : "L = 0"; }},
    kLargestSlope{"largest slope",
                  [](const Trial&t) { return Text("%.3g", t.learned.problem->declaration.lipschitz.maxCoeff()); }},
    kChange{"steering, at most",
            [](const Trial&t) { return Text("%.2g", t.learned.problem->domain.inequalities.front().bound); }},
    kLeftOut{"left out", [](const Trial&t) { return std::to_string(t.learned.left_out); }},
    kSteps{"steps", [](const Trial&t) { return std::to_string(t.judged.steps); }},
    kWindows{"windows", [](const Trial&t) { return std::to_string(t.judged.windows.size()); }},
    kComplete{"complete",
              [](const Trial&t) { return Percent(t.judged.complete(), static_cast<int>(t.judged.windows.size())); }},
    kInside{"inside, %", [](const Trial&t) { return Percent(t.judged.inside(), t.judged.slices()); }},
    kHalfWidth{"half-width, m", [](const Trial&t) { return Text("%.3f", t.judged.HalfWidth()); }},
    kLargest{"largest, m", [](const Trial&t) { return Text("%.3f", t.judged.LargestHalfWidth()); }},
    kDistance{"driven, m", [](const Trial&t) { return Text("%.2f", t.judged.Distance()); }},
    kContradicting{"contradictions, per thousand",
                   [](const Trial&t) {
                     return Text("%.1f", 1000.0 * t.judged.contradicting / std::max(1, t.judged.transitions));
                   }},
    kBeyond{"errors above sigma + w, per thousand",
            [](const Trial&t) { return Text("%.1f", 1000.0 * t.judged.beyond / std::max(1, t.judged.transitions)); }},
    kOutside{"outside the domain, %", [](const Trial&t) {
               return Percent(t.judged.outside_domain, t.judged.outside_domain + t.judged.transitions);
             }};
const Field kCertified[] = {{"certified in 0.1 m, %", CertifiedIn<0>},
                            {"0.15 m, %", CertifiedIn<1>},
                            {"0.2 m, %", CertifiedIn<2>},
                            {"0.3 m, %", CertifiedIn<3>}};

std::vector<Field> AllFields() {
  std::vector<Field> all{{"table", [](const Trial& t) { return t.table; }},
                         kLearnedFrom,
                         kJudgedBy,
                         kCount,
                         kQuantile,
                         kFactor,
                         kLargestSlope,
                         kChange,
                         kLeftOut,
                         kSteps,
                         kWindows,
                         kComplete,
                         kInside,
                         kHalfWidth,
                         kLargest,
                         kDistance,
                         kContradicting,
                         kBeyond,
                         kOutside};
  all.insert(all.end(), std::begin(kCertified), std::end(kCertified));
  all.insert(all.end(), {{"w of x", Disturbance<0>},
                         {"w of y", Disturbance<1>},
                         {"w of yaw", Disturbance<2>},
                         {"w of v", Disturbance<3>},
                         {"w of r", Disturbance<4>}});
  return all;
}

std::string Csv(const std::vector<Trial>& trials) {
  std::string text;
  const std::vector<Field> fields = AllFields();
  const auto line = [&](auto&& of) {
    for (std::size_t i = 0; i < fields.size(); ++i) text += (i > 0 ? ",\"" : "\"") + std::string(of(fields[i])) + "\"";
    text += "\n";
  };
  line([](const Field& field) { return field.name; });
  for (const Trial& trial : trials) line([&](const Field& field) { return field.text(trial); });
  return text;
}

std::string Markdown(const std::vector<Trial>& trials, const std::string& table, const std::vector<Field>& fields) {
  std::string text = "\n|", rule = "|";
  for (const Field& field : fields) text += std::string(" ") + field.name + " |", rule += "---|";
  text += "\n" + rule + "\n";
  for (const Trial& trial : trials) {
    if (trial.table != table) continue;
    text += "|";
    for (const Field& field : fields) text.append(" ").append(field.text(trial)).append(" |");
    text += "\n";
  }
  return text;
}

// ---- the study

using Stretches = std::vector<Stretch>;

void Append(Stretches& all, const Stretches& more) { all.insert(all.end(), more.begin(), more.end()); }

// Learns from one part and judges by another.
struct Fold {
  std::string learned_from, judged_by;
  Fitted fitted;
  Stretches judge;
};

struct Study {
  Problem driving = DrivingProblem();
  std::vector<Drive> drives, others;
  std::string names;
  Grid grid;
  std::vector<Trial> trials;
  Fit fit;  // to the first of the two parts

  [[nodiscard]] Stretches BlocksOfAll(bool odd) const {
    Stretches all;
    for (const Drive& drive : drives) Append(all, Blocks(drive, odd));
    return all;
  }
  // Alternate blocks of all drives, either way: the trials' counts are those of both together.
  [[nodiscard]] std::vector<Fold> BothWays(const Problem& problem, int most = 0) const {
    std::vector<Fold> folds;
    for (const bool odd : {false, true})
      folds.push_back({names, "the blocks between", FitTo(problem, BlocksOfAll(odd), most), BlocksOfAll(!odd)});
    return folds;
  }

  // One trial for each factor and length of windows.
  void Try(const std::string& table, const std::vector<Fold>& folds, const LearnOptions& options,
           const std::vector<double>& factors, const std::vector<int>& lengths) {
    std::vector<Learned> learned;
    learned.reserve(folds.size());
    for (const Fold& fold : folds) learned.push_back(Learn(fold.fitted, options));
    if (!std::ranges::all_of(learned, &Learned::explained)) return;
    for (const double factor : factors)
      for (const int steps : lengths) {
        Trial& trial = trials.emplace_back();
        trial.table = table;
        trial.learned_from = folds.front().learned_from;
        trial.judged_by = folds.front().judged_by;
        trial.options = options;
        trial.factor = factor;
        trial.judged.steps = steps;
        for (std::size_t i = 0; i < folds.size(); ++i) {
          const Learned scaled = WithSlopesTimes(learned[i], factor);
          trial.judged.Add(Judge(scaled, folds[i].judge, steps));
          if (i == 0) trial.learned = scaled;
        }
      }
  }

  void Run() {
    const std::vector<Fold> folds = BothWays(driving);
    for (const double quantile : grid.quantiles) Try("quantile", folds, {.quantile = quantile}, {1}, {kShort, kLong});
    for (const double quantile : grid.slope_quantiles)
      Try("slopes", folds, {.quantile = quantile, .slopes = true}, grid.factors, {kShort});
    for (const int size : grid.sizes) Try("size", BothWays(driving, size), {.quantile = kChosen}, {1}, {kShort});
    Try("size", folds, {.quantile = kChosen}, {1}, {kShort});
    for (const double change : grid.changes) {
      const std::vector<Fold> gentle = BothWays(DrivingProblem(change));
      for (const double quantile : grid.change_quantiles)
        Try("steering", gentle, {.quantile = quantile}, {1}, {kShort});
    }
    TryEachWay(folds, "");
    TryEachWay(BothWays(DrivingProblem(kGentle)), ", steering within " + Text("%g", kGentle));
    for (const Drive& from : drives)
      Try("drives",
          {{from.name + ", even blocks", "the blocks between", FitTo(driving, Blocks(from, false)),
            Blocks(from, true)}},
          {.quantile = kChosen}, {1}, {kShort});
    for (const Drive& from : drives) {
      std::vector<const Drive*> rest;
      for (const Drive& by : drives)
        if (&by != &from) rest.push_back(&by);
      TryDrives(from.name, Whole(from), rest);
    }
    Stretches all;
    for (const Drive& drive : drives) Append(all, Whole(drive));
    std::vector<const Drive*> rest;
    for (const Drive& by : others) rest.push_back(&by);
    TryDrives(names, all, rest);
    fit = folds.front().fitted.fit;
  }
  void TryEachWay(const std::vector<Fold>& folds, const std::string& domain) {
    for (std::size_t i = 0; i < folds.size(); ++i) {
      Fold fold = folds[i];
      fold.learned_from += (i == 0 ? ", even blocks" : ", odd blocks") + domain;
      Try("drives", {fold}, {.quantile = kChosen}, {1}, {kShort});
    }
  }
  // In the domain of what was learned from, and in that of both.
  void TryDrives(const std::string& name, const Stretches& learn, const std::vector<const Drive*>& judges) {
    if (judges.empty()) return;
    const Fitted fitted = FitTo(driving, learn);
    for (const Drive* by : judges) {
      Stretches both = learn;
      Append(both, Whole(*by));
      Try("drives", {{name, by->name, fitted, Whole(*by)}}, {.quantile = kChosen}, {1}, {kShort});
      Try("drives", {{name, by->name + ", its domain as well", fitted, Whole(*by)}},
          {.quantile = kChosen, .domain_of = both}, {1}, {kShort});
    }
  }
};

Study ReadAll(const RealOptions& options) {
  Study study;
  study.grid = options.quick ? kQuick : kWhole;
  for (const std::string& file : FindRecordings(options.data))
    study.drives.push_back(TransitionsOf(ReadRecording(file), study.driving));
  for (const std::string& file : options.others)
    study.others.push_back(TransitionsOf(ReadRecording(file), study.driving));
  for (const Drive& drive : study.drives) {
    study.names += (study.names.empty() ? "" : " and ") + drive.name;
    constexpr int kFewest = 100;
    if (drive.transitions.size() < kFewest)
      throw ConfigError(drive.name + ": the car drives at 1 m/s or more, under power, in " +
                        std::to_string(drive.transitions.size()) + " steps of 0.1 s; there have to be " +
                        std::to_string(kFewest));
  }
  return study;
}

// ---- the report

std::string Delays(const std::vector<double>& delays) {
  if (delays.empty()) return "";
  return "; the curvature is half way to a new steering command " + Text("%.2f", delays.front()) + " to " +
         Text("%.2f s", delays.back()) + " after the log has it (" + std::to_string(delays.size()) + " steps of it)";
}

std::string AboutData(const Study& study) {
  std::string text;
  for (const std::vector<Drive>* all : {&study.drives, &study.others})
    for (const Drive& drive : *all)
      text += "- " + drive.name + ": " + std::to_string(drive.transitions.size()) +
              " steps of 0.1 s in which the car drives, at " + Text("%.2f", drive.transitions.z.col(3).minCoeff()) +
              " to " + Text("%.2f m/s", drive.transitions.z.col(3).maxCoeff()) +
              "; standard errors of a measured state: place " + Text("%.2g mm", 1000 * drive.deviation[0]) + ", yaw " +
              Text("%.2g mrad", 1000 * drive.deviation[2]) + ", speed " + Text("%.2g mm/s", 1000 * drive.deviation[3]) +
              ", yaw rate " + Text("%.2g mrad/s", 1000 * drive.deviation[4]) + Delays(drive.delays) + "\n";
  return text;
}

std::string AboutFit(const Learned& learned, const Fit& fit) {
  std::string text =
      "\n| state | rms before the fit | after | largest after | sigma | w |\n|---|---|---|---|---|---|\n";
  const Problem& problem = *learned.problem;
  for (Eigen::Index k = 0; k < 5; ++k) {
    const auto rms = [&](const Eigen::MatrixXd& errors) {
      return Text("%.4f", std::sqrt(errors.col(k).squaredNorm() / static_cast<double>(errors.rows())));
    };
    text += "| " + problem.model->state_names()[static_cast<std::size_t>(k)] + " | " + rms(fit.before) + " | " +
            rms(fit.after) + " | " + Text("%.4f", fit.after.col(k).cwiseAbs().maxCoeff()) + " | " +
            Text("%.4f", problem.declaration.noise_bound[k]) + " | " +
            Text("%.4f", problem.declaration.disturbance[k]) + " |\n";
  }
  return text;
}

std::vector<Field> With(std::vector<Field> first, const std::vector<Field>& more) {
  first.insert(first.end(), more.begin(), more.end());
  return first;
}

std::string Report(const Study& study, const Learned& chosen, const RealOptions& options) {
  const std::vector<Field> outcome{kInside, kHalfWidth, kLargest, kContradicting, kBeyond},
      corridors(std::begin(kCertified), std::end(kCertified));
  return "# A real car\n\nMade by `" + options.command + "`.\n\n" + AboutData(study) +
         "\nA declaration that was learned from data is an assumption. These tables say how it fared on other data of "
         "the\nsame car, and nothing about data that nobody has.\n\n" +
         "## One-step errors\nOf every other block of " + study.names + ", in m, rad, m/s, rad/s; w for quantile " +
         Text("%g", kChosen) + ".\n" + AboutFit(chosen, study.fit) + "\n## Against the quantile\n" +
         Markdown(study.trials, "quantile",
                  With({kQuantile, kLeftOut, kSteps, kWindows, kComplete, kDistance}, With(outcome, corridors))) +
         "\n## Against the factor on L\n" +
         Markdown(study.trials, "slopes", With({kQuantile, kFactor, kLargestSlope, kWindows, kComplete}, outcome)) +
         "\n## Against N\n" + Markdown(study.trials, "size", With({kCount, kWindows, kComplete}, outcome)) +
         "\n## Against the change of steering from step to step\n" +
         Markdown(study.trials, "steering",
                  With({kChange, kQuantile, kOutside, kWindows, kComplete}, With(outcome, corridors))) +
         "\n## Against what it is learned from\n" +
         Markdown(study.trials, "drives",
                  With({kLearnedFrom, kJudgedBy, kCount, kOutside, kWindows, kComplete, kDistance}, outcome));
}

// ---- pictures

Plot TradeOff(const Study& study) {
  std::string blocks, lines;
  for (const int steps : {kShort, kLong}) {
    std::string data;
    for (const Trial& trial : study.trials)
      if (trial.table == "quantile" && trial.judged.steps == steps)
        data += DataLine({trial.judged.HalfWidth().value_or(NAN),
                          100.0 * trial.judged.inside() / std::max(1, trial.judged.slices()), trial.options.quantile});
    blocks += DataBlock("after" + std::to_string(steps), data);
  }
  const auto series = [](int steps, const char* color, const char* what) {
    const std::string data = "$after" + std::to_string(steps);
    return data + " using 1:2 with linespoints pt 7 ps 0.6 lw 2 lc rgb " + color + " title '" + what + "', " + data +
           " using 1:2:($3 == 0.98 || $3 == 0.99 ? '' : sprintf('%g', $3)) with labels right offset -0.8,0.3 font ',9' "
           "textcolor rgb '#666666' notitle";
  };
  return {"real-trade-off",
          "Recorded states inside their slices against the median half-width of the last one, for each quantile.", 720,
          440,
          blocks +
              "set xlabel 'half-width of the position at the end, m'\nset logscale x\nset key bottom right\n"
              "set ylabel 'recorded states inside their slices, %'\nset xtics (0.05,0.1,0.15,0.25,0.5,1,2)\nset yrange "
              "[*:100.4]\n"
              "set arrow from 0.15,graph 0 to 0.15,graph 1 nohead dt 2 lc rgb grey\n"
              "plot 99 lc rgb grey dt 2 title 'goal: 99 % at 0.15 m after 0.5 s', " +
              series(kShort, "blue", "windows of 0.5 s") + ", " + series(kLong, "red", "windows of 1 s") + "\n"};
}

Plot Tubes(const Trial& trial) {
  constexpr std::size_t kShown = 12;
  std::string boxes, path;
  for (std::size_t i = 0; i < std::min(kShown, trial.judged.windows.size()); ++i) {
    const WindowResult& window = trial.judged.windows[i];
    for (Eigen::Index t = 0; t < window.center.cols(); ++t)
      boxes += DataLine({window.center(0, t), window.center(1, t), window.half_width(0, t), window.half_width(1, t)});
    for (Eigen::Index t = 0; t < window.path.cols(); ++t) path += DataLine({window.path(0, t), window.path(1, t)});
    path += "\n";
  }
  return {"real-tubes",
          "The first windows of 0.5 s of the judging blocks: slices of the certified tubes, and where the car was.",
          720, 560,
          DataBlock("boxes", boxes) + DataBlock("path", path) +
              "set size ratio -1\nset xlabel 'x, m'\nset ylabel 'y, m'\nset key bottom left\n"
              "plot $boxes using 1:2:3:4 with boxxyerror lc rgb blue title 'slices of the tubes', "
              "$path using 1:2 with linespoints pt 7 ps 0.4 lc rgb 'black' title 'recorded'\n"};
}

// ---- the task

std::string List(const Eigen::VectorXd& numbers) {
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "[" : ", ") + Text("%.17g", number);
  return text + "]";
}

std::string Task(const Learned& learned, const Fit& fit) {
  const Problem& problem = *learned.problem;
  std::string parameters;
  for (const FittedParameter& each : fit.parameters)
    parameters += (parameters.empty() ? "" : ", ") + each.name + ": " + Text("%.17g", each.after);
  const Eigen::VectorXd start = problem.transitions.z.row(0).head(6);
  return "# Learned from logs: an assumption, not a proof. research/real-car.md.\nmodel: {file: real-model.yaml, "
         "parameters: {" +
         parameters + "}}\ndomain:\n  state: {lower: " + List(problem.domain.state.lower()) +
         ", upper: " + List(problem.domain.state.upper()) +
         "}\n  input: {lower: " + List(problem.domain.input.lower()) +
         ", upper: " + List(problem.domain.input.upper()) +
         "}\ndeclaration:\n  lipschitz: {}\n  noise_bound: " + List(problem.declaration.noise_bound) +
         "\n  disturbance: " + List(problem.declaration.disturbance) +
         "\ntransitions: real-transitions.csv\ntask:\n  initial_set: {center: " + List(start) +
         ", half_width: " + List(learned.state_error) +
         "}\n  projection: [x, y]\n  obstacles: []\n  between: samples\n";
}

}  // namespace

void RunReal(const RealOptions& options, std::ostream& out) {
  Study study = ReadAll(options);
  study.Run();
  const Trial& chosen = *std::ranges::find_if(
      study.trials, [](const Trial& trial) { return trial.table == "quantile" && trial.options.quantile == kChosen; });

  fs::create_directories(options.directory);
  std::string report = Report(study, chosen.learned, options);
  out << report << std::flush;
  for (const Plot& plot : {TradeOff(study), Tubes(chosen)})
    if (Draw(plot, options.directory / "plots", options.directory / "figures"))
      report += "\n![" + plot.caption + "](figures/" + plot.name + ".svg)\n\n" + plot.caption + "\n";
  WriteFile(options.directory / "real.csv", Csv(study.trials));
  WriteFile(options.directory / "real.md", report);
  fs::copy_file(kModelFile, options.directory / "real-model.yaml", fs::copy_options::overwrite_existing);
  WriteFile(options.directory / "real-task.yaml", Task(chosen.learned, study.fit));
  SaveTransitions((options.directory / "real-transitions.csv").string(), *chosen.learned.problem->model,
                  chosen.learned.problem->transitions);
}

}  // namespace forereach::research
