#include "research/real/real.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>

#include "identify/declare_by.h"
#include "research/markdown.h"
#include "research/plot.h"
#include "research/real/study.h"
#include "research/run_directory.h"
#include "task/config.h"
#include "task/config_error.h"

namespace forereach::research {
namespace {

namespace fs = std::filesystem;

const std::vector<double> kQuantiles{0.9, 0.95, 0.97, 0.98, 0.985, 0.9875, 0.99, 0.995, 1}, kFew{0.9, 0.985, 1};

constexpr int kSteps = 5;          // of a window
constexpr double kChosen = 0.985;  // the quantile of every table that does not vary it

// ---- trials

struct Trial {
  std::string table, learned_from, judged_by, way;
  double quantile = kChosen;
  Learned learned;  // of the last that were added up
  Judgement judged;
};

// What a trial shows, in the order of the CSV's columns.
struct Field {
  const char* name;
  std::function<std::string(const Trial&)> text;
};

const Field kLearnedFrom{"learned from", [](const Trial&t) { return t.learned_from; }},
    kJudgedBy{"judged by", [](const Trial&t) { return t.judged_by; }},
    kWay{"declared", [](const Trial&t) { return t.way; }},
    kCount{"N", [](const Trial&t) { return std::to_string(t.learned.transitions); }},
    kQuantile{"quantile", [](const Trial&t) { return Text("%.4g", t.quantile); }},
    kLeftOut{"left out", [](const Trial&t) { return std::to_string(t.learned.left_out); }},
    kLength{"steps", [](const Trial&t) { return std::to_string(t.judged.steps); }},
    kCovered{
        "covered, %",
        [](const Trial&t) { return Percent(t.judged.transitions, t.judged.outside_domain + t.judged.transitions); }},
    kJudged{"covered steps", [](const Trial&t) { return std::to_string(t.judged.transitions); }},
    kWindows{"windows", [](const Trial&t) { return std::to_string(t.judged.windows.size()); }},
    kComplete{"complete, %",
              [](const Trial&t) { return Percent(t.judged.complete(), static_cast<int>(t.judged.windows.size())); }},
    kInside{"inside, %", [](const Trial&t) { return Percent(t.judged.inside(), t.judged.slices()); }},
    kHalfWidth{"half-width, m", [](const Trial&t) { return Text("%.3f", t.judged.HalfWidth()); }},
    kDistance{"driven, m", [](const Trial&t) { return Text("%.2f", t.judged.Distance()); }},
    kContradicting{"contradictions, per thousand", [](const Trial&t) {
                     const double all = t.judged.transitions;
                     return Text("%.1f", all > 0 ? std::optional(1000.0 * t.judged.contradicting / all) : std::nullopt);
                   }};
const std::vector<Field> kOutcome{kJudged,   kCovered, kWindows,   kComplete,
                                  kDistance, kInside,  kHalfWidth, kContradicting};

constexpr std::pair<const char*, Eigen::Index> kWithDisturbance[] = {
    {"w of x", 0}, {"w of yaw", 2}, {"w of v", 3}, {"w of r", 4}};
constexpr std::pair<const char*, Eigen::Index> kWithGrowth[] = {
    {"growth of x", 0}, {"growth of yaw", 2}, {"growth of v", 3}, {"growth of r", 4}};

std::vector<Field> AllFields() {
  std::vector<Field> all = Join({{"table", [](const Trial& t) { return t.table; }},
                                 kLearnedFrom,
                                 kJudgedBy,
                                 kWay,
                                 kCount,
                                 kQuantile,
                                 kLeftOut,
                                 kLength},
                                kOutcome);
  for (const auto& [name, k] : kWithDisturbance)
    all.push_back(
        {name, [k = k](const Trial& t) { return Text("%.4g", t.learned.problem->declaration.disturbance[k]); }});
  for (const auto& [name, k] : kWithGrowth)
    all.push_back({name, [k = k](const Trial& t) {
                     return t.learned.growth.size() > k ? Text("%.4g", t.learned.growth[k]) : "0";
                   }});
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

std::string TableOf(const std::vector<Trial>& trials, const std::string& table, const std::vector<Field>& fields) {
  const auto cells = [&](auto&& of) {
    Cells all;
    std::ranges::transform(fields, std::back_inserter(all), of);
    return all;
  };
  std::vector<Cells> rows;
  for (const Trial& trial : trials)
    if (trial.table == table) rows.push_back(cells([&](const Field& field) { return field.text(trial); }));
  return Markdown(cells([](const Field& field) { return field.name; }), rows);
}

// ---- the study

const char* const kConstant = "one w";
const char* const kGrowing = "w that grows";

struct Study {
  const Problem driving = DrivingProblem();
  std::vector<Drive> drives, at_stamps, others;  // the second: the first, with commands where the log has them
  std::vector<Trial> trials;
  std::vector<std::pair<std::string, std::vector<HiddenState>>> hidden;  // of each drive
  std::vector<Cells> refuted;                                            // that rows are affine

  [[nodiscard]] static std::string NamesOf(const std::vector<Stretch>& stretches) {
    std::string names;
    for (const Stretch& stretch : stretches) names += (names.empty() ? "" : " and ") + stretch.drive->name;
    return names;
  }
  [[nodiscard]] static std::vector<Stretch> AllBut(const std::vector<Drive>& drives, const std::string& name) {
    std::vector<Stretch> all;
    for (const Drive& drive : drives)
      if (drive.name != name) all.push_back(Whole(drive).front());
    return all;
  }

  void Add(const std::string& table, const std::vector<Stretch>& from, const Drive& by, const std::string& way,
           const Learned& learned, double quantile = kChosen) {
    trials.push_back({table, NamesOf(from), by.name, way, quantile, learned, Judge(learned, Whole(by), kSteps)});
  }
  void LeaveOut(std::size_t i, const std::vector<double>& quantiles) {
    const Drive& out = drives[i];
    const std::vector<Stretch> rest = AllBut(drives, out.name), stamped = AllBut(at_stamps, out.name);
    const Fitted fitted = FitTo(driving, rest), own = FitTo(driving, Whole(out));
    Add("leave one out", rest, out, "as `declare --from-data` proposes", Proposed(fitted));
    Add("leave one out", rest, out, kConstant, Learn(fitted, {.quantile = kChosen}));
    Add("leave one out", stamped, at_stamps[i], "w that grows, commands where the log has them",
        Learn(FitTo(driving, stamped), {.quantile = kChosen, .growing = true}));
    Add("leave one out", rest, out, kGrowing, Learn(fitted, {.quantile = kChosen, .growing = true}));
    for (const double quantile : {kChosen, 0.97}) {  // the second contradicts as often as w alone
      const Learned affine = Learn(fitted, {.quantile = quantile, .growing = true, .affine = true});
      Add("leave one out", rest, out, "w that grows, affine rows, quantile " + Text("%g", quantile), affine, quantile);
      if (quantile == kChosen) RefuteAffineRows(fitted, affine, rest);
    }
    constexpr double kMore = 0.99;  // regions take some of it back
    Add("leave one out", rest, out, "w that grows, less in 3 regions, quantile 0.99",
        Learn(fitted, {.quantile = kMore, .growing = true, .cells = 3}), kMore);
    Add("leave one out", rest, out, "w that grows, in a domain widened to this drive",
        Learn(fitted, {.quantile = kChosen, .growing = true, .domain_of = AllBut(drives, "")}));
    Add("leave one out", Whole(out), out, kConstant, Learn(own, {.quantile = kChosen}));
    Add("leave one out", Whole(out), out, kGrowing, Learn(own, {.quantile = kChosen, .growing = true}));
    hidden.emplace_back(out.name, HiddenStates(own, out));
    for (const double quantile : quantiles) {
      AddUp(i == 0, fitted, out, quantile);
      Add("itself", Whole(out), out, kGrowing, Learn(own, {.quantile = quantile, .growing = true}), quantile);
    }
  }
  void RefuteAffineRows(const Fitted& fitted, const Learned& affine, const std::vector<Stretch>& from) {
    for (const bool disturbed : {false, true}) {
      refuted.push_back({NamesOf(from), std::to_string(fitted.transitions.size()), disturbed ? "declared" : "0"});
      for (const int k : affine.problem->declaration.affine.rows) {
        const auto found = RefuteAffine(fitted, affine, k, disturbed);
        refuted.back().push_back(found ? std::to_string(found->after) : "-");
      }
    }
  }
  // The trial of a quantile has the counts of all drives that are left out.
  void AddUp(bool first, const Fitted& fitted, const Drive& out, double quantile) {
    const Learned learned = Learn(fitted, {.quantile = quantile, .growing = true});
    if (first) {
      trials.push_back({"quantile", "the others", "each drive", kGrowing, quantile, learned, {}});
      trials.back().judged.steps = kSteps;
    }
    Trial& trial = *std::ranges::find_if(
        trials, [&](const Trial& each) { return each.table == "quantile" && each.quantile == quantile; });
    trial.judged.Add(Judge(learned, Whole(out), kSteps));
    trial.learned = learned;
  }
  void JudgeOthers() {
    if (others.empty()) return;
    const std::vector<Stretch> all = AllBut(drives, "");
    const Fitted fitted = FitTo(driving, all);
    for (const Drive& by : others) {
      Add("others", all, by, kConstant, Learn(fitted, {.quantile = kChosen}));
      Add("others", all, by, kGrowing, Learn(fitted, {.quantile = kChosen, .growing = true}));
      Add("others", Whole(by), by, kGrowing, Learn(FitTo(driving, Whole(by)), {.quantile = kChosen, .growing = true}));
    }
  }
};

Study ReadAll(const RealOptions& options) {
  Study study;
  for (const std::string& file : FindRecordings(options.data)) {
    study.drives.push_back(TransitionsOf(ReadRecording(file), study.driving));
    study.at_stamps.push_back(TransitionsOf(ReadRecording(file, 0), study.driving));
  }
  for (const std::string& file : options.others)
    study.others.push_back(TransitionsOf(ReadRecording(file), study.driving));
  for (const std::vector<Drive>* all : {&study.drives, &study.at_stamps, &study.others})
    for (const Drive& drive : *all) {
      constexpr int kFewest = 100;
      if (drive.transitions.size() < kFewest)
        throw ConfigError(drive.name + ": the car drives at 1 m/s or more, under power, in " +
                          std::to_string(drive.transitions.size()) + " steps of 0.1 s; there have to be " +
                          std::to_string(kFewest));
    }
  if (study.drives.size() < 2)
    throw ConfigError(options.data.string() + ": has one drive; to leave one out there have to be two");
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
  std::vector<Cells> rows;
  const Problem& problem = *learned.problem;
  for (Eigen::Index k = 0; k < 5; ++k) {
    const auto rms = [&](const Eigen::MatrixXd& errors) {
      return std::sqrt(errors.col(k).squaredNorm() / static_cast<double>(errors.rows()));
    };
    rows.push_back({problem.model->state_names()[static_cast<std::size_t>(k)]});
    for (const double value : {rms(fit.before), rms(fit.after), fit.after.col(k).cwiseAbs().maxCoeff(),
                               learned.state_error[k], problem.declaration.disturbance[k], learned.growth[k]})
      rows.back().push_back(Text("%.4f", value));
  }
  return Markdown({"state", "rms before the fit", "after", "largest after", "state error", "w, not hasty", "growth"},
                  rows);
}

std::string Hidden(const Study& study) {
  std::vector<Cells> rows;
  for (std::size_t i = 0; i < study.hidden.front().second.size(); ++i)
    for (const auto& [drive, states] : study.hidden) {
      rows.push_back({states[i].name, drive});
      for (const Eigen::Index k : {2, 3, 4}) rows.back().push_back(Text("%.1f", 100 * states[i].left[k]));
    }
  return Markdown({"state", "drive", "yaw, %", "v, %", "r, %"}, rows);
}

std::string Report(const Study& study, const Learned& all, const Fit& fit, const RealOptions& options) {
  const std::vector<Field> outcome = Join({kLearnedFrom, kJudgedBy, kWay}, kOutcome);
  return "# A real car\n\nMade by `" + options.command + "`.\n\n" + AboutData(study) +
         "\nA declaration that was learned from data is an assumption. These tables say how it fared on other data of "
         "the\nsame car, and nothing about data that nobody has.\n\n"
         "## Each drive left out\nThe quantile is " +
         Text("%g", kChosen) +
         ". Judged by the drive that it was learned from, a declaration is the best that these states allow.\n" +
         TableOf(study.trials, "leave one out", outcome) +
         (study.others.empty() ? "" : "\n## Other drives\n" + TableOf(study.trials, "others", outcome)) +
         "\n## Against the quantile\nOf all drives together, each left out in its turn; w grows.\n" +
         TableOf(study.trials, "quantile", Join({kQuantile}, kOutcome)) +
         "\nOf each drive, learned from it and judged by it; w grows.\n" +
         TableOf(study.trials, "itself", Join({kJudgedBy, kQuantile}, kOutcome)) +
         "\n## Affine rows\nSo many steps of the drives, in their order, refute that the residual of a state is "
         "affine.\n" +
         Markdown({"drives", "N", "w", "yaw", "v", "r"}, study.refuted) +
         "\n## Hidden states\nWhat the best fit to a drive leaves of its errors, where a line in a further state is "
         "taken off them.\n" +
         Hidden(study) + "\n## One-step errors\nOf all drives, in m, rad, m/s, rad/s; w grows.\n" + AboutFit(all, fit);
}

// ---- pictures

Plot TradeOff(const Study& study) {
  std::string data;
  for (const Trial& trial : study.trials)
    if (trial.table == "quantile" && std::isfinite(trial.judged.HalfWidth().value_or(NAN)))
      data += DataLine({*trial.judged.HalfWidth(), 100.0 * trial.judged.inside() / std::max(1, trial.judged.slices()),
                        1000.0 * trial.judged.contradicting / std::max(1, trial.judged.transitions), trial.quantile});
  return {"real-trade-off",
          "Recorded states inside their slices, and steps that contradict, against the half-width, for each quantile.",
          720, 440,
          DataBlock("left", data) +
              "set border 11\nset xlabel 'half-width of the position after 0.5 s, m'\nset xtics 0.05\nset key center "
              "right\n"
              "set ylabel 'recorded states inside their slices, %'\nset ytics nomirror\nset yrange [*:100.4]\n"
              "set y2label 'contradictions, per thousand'\nset y2tics\nset y2range [0:*]\n"
              "set offsets graph 0.05, graph 0.1, 0, graph 0.1\n"
              "set arrow from 0.25,graph 0 to 0.25,graph 1 nohead dt 2 lc rgb grey\n"
              "plot 99 lc rgb grey dt 2 title 'goal: 99 %, 0.25 m', $left using 1:2 with linespoints pt 7 ps 0.6 lw 2 "
              "lc rgb blue title 'inside', $left using 1:2:($4 == 0.98 || $4 == 0.9875 || $4 == 0.99 ? '' : "
              "sprintf('%g', $4)) with labels left offset 0.6,-0.7 font ',9' textcolor rgb '#666666' notitle, $left "
              "using 1:3 axes x1y2 with linespoints pt 5 ps 0.6 lw 2 lc rgb red title 'contradictions'\n"};
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
  return {"real-tubes", "The first windows of 0.5 s of a drive left out: slices of the tubes, and where the car was.",
          720, 560,
          DataBlock("boxes", boxes) + DataBlock("path", path) +
              "set size ratio -1\nset xlabel 'x, m'\nset ylabel 'y, m'\nset key bottom left\n"
              "plot $boxes using 1:2:3:4 with boxxyerror lc rgb blue title 'slices of the tubes', $path using 1:2 with "
              "linespoints pt 7 ps 0.4 lc rgb 'black' title 'recorded'\n"};
}

// ---- the task

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
         ", upper: " + List(problem.domain.input.upper()) + "}\ndeclaration:\n" +
         DeclarationYaml(problem.declaration, *problem.model) +
         "transitions: real-transitions.csv\ntask:\n  initial_set: {center: " + List(start) +
         ", half_width: " + List(learned.state_error) +
         "}\n  projection: [x, y]\n  obstacles: []\n  between: samples\n";
}

}  // namespace

void RunReal(const RealOptions& options, std::ostream& out) {
  Study study = ReadAll(options);
  for (std::size_t i = 0; i < study.drives.size(); ++i) study.LeaveOut(i, options.quick ? kFew : kQuantiles);
  study.JudgeOthers();
  const Fitted fitted = FitTo(study.driving, Study::AllBut(study.drives, ""));
  const Learned all = Learn(fitted, {.quantile = kChosen, .growing = true});
  const Trial& shown = *std::ranges::find_if(
      study.trials, [](const Trial& trial) { return trial.table == "quantile" && trial.quantile == kChosen; });

  fs::create_directories(options.directory);
  std::string report = Report(study, all, fitted.fit, options);
  out << report << std::flush;
  for (const Plot& plot : {TradeOff(study), Tubes(shown)})
    if (Draw(plot, options.directory / "plots", options.directory / "figures"))
      report += "\n![" + plot.caption + "](figures/" + plot.name + ".svg)\n\n" + plot.caption + "\n";
  WriteFile(options.directory / "real.csv", Csv(study.trials));
  WriteFile(options.directory / "real.md", report);
  fs::copy_file(kModelFile, options.directory / "real-model.yaml", fs::copy_options::overwrite_existing);
  WriteFile(options.directory / "real-task.yaml", Task(all, fitted.fit));
  SaveTransitions((options.directory / "real-transitions.csv").string(), *all.problem->model, all.problem->transitions);
}

}  // namespace forereach::research
