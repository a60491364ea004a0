#include "research/plans.h"

#include <functional>
#include <optional>
#include <ostream>
#include <stdexcept>

#include <fmt/format.h>

#include "forereach/numerics/parallel.h"
#include "forereach/numerics/text.h"
#include "research/experiment.h"
#include "research/run_directory.h"
#include "research/statistics.h"
#include "task/config.h"

namespace forereach::research {
namespace {

const Column kSeed{"seed", "from 0; the report's ten are 0 to 9"}, kGroup{"group", "A, B or C"},
    kPlan{"plan", "from 0, in each group and seed"};

// Puts lines together from values of any kind that has a text.
class Line final {
 public:
  Line& operator<<(const std::string& text) {
    text_.append(text_.empty() ? "" : ",").append(text);
    return *this;
  }
  Line& operator<<(const char* text) { return *this << std::string(text); }
  Line& operator<<(char letter) { return *this << std::string(1, letter); }
  Line& operator<<(int number) { return *this << std::to_string(number); }
  Line& operator<<(double number) { return *this << ToText(number); }
  Line& operator<<(const std::optional<double>& number) { return *this << (number ? ToText(*number) : ""); }
  [[nodiscard]] std::string End() const { return text_ + "\n"; }

 private:
  std::string text_;
};

void Replace(std::string& text, const std::string& what, const std::string& by) {
  if (const std::size_t at = text.find(what); at != std::string::npos) text.replace(at, what.size(), by);
}

std::string HeaderOf(const File& file, const NominalModel& model) {
  Line line;
  for (const Column& column : file.columns) {
    const std::string name = column.name;
    const bool of_states = name.find("STATE") != std::string::npos;
    if (!of_states && name.find("INPUT") == std::string::npos) {
      line << name;
      continue;
    }
    for (const std::string& own : of_states ? model.state_names() : model.input_names()) {
      std::string expanded = name;
      Replace(expanded, of_states ? "STATE" : "INPUT", own);
      line << expanded;
    }
  }
  return line.End();
}

// The lines of each file of FilesOfPlans but the last, of one seed.
struct Lines {
  std::string scenarios, controls, outcomes;
};

void Describe(const System& system, int seed, Group group, int plan, Lines& lines) {
  const Scenario scenario = MakeScenario(system, group, seed, plan);
  Line line;
  line << seed << NameOf(group) << plan << scenario.obstacle.center.x() << scenario.obstacle.center.y()
       << scenario.obstacle.radius;
  for (const double x : scenario.center) line << x;
  for (const double x : system.initial_half_width) line << x;
  lines.scenarios += line.End();
  for (int t = 0; t < system.horizon; ++t) {
    Line step;
    step << seed << NameOf(group) << plan << t;
    for (const double u : scenario.controls.col(t)) step << u;
    lines.controls += step.End();
  }
}

std::string Describe(int seed, const PlanOutcome& of) {
  static constexpr const char* kCovers[] = {"inside", "outside", "undecided"};
  Line line;
  line << seed << of.group << of.plan << of.answer << of.step << int(of.safe) << int(of.complete)
       << kCovers[static_cast<std::size_t>(of.cover)] << of.area;
  return line.End();
}

// A figure of a group: of so many plans, so many.
struct Figure {
  const char* name;
  int (*count)(const Tally&);
  int (*of)(const Tally&);
};

constexpr Figure kFigures[] = {
    {"recall", [](const Tally& t) { return t.certified_safe; }, [](const Tally& t) { return t.safe; }},
    {"coverage", [](const Tally& t) { return t.covered; }, [](const Tally& t) { return t.complete(); }},
    {"certified", [](const Tally& t) { return t.certified; }, [](const Tally& t) { return t.plans; }},
    {"false", [](const Tally& t) { return t.false_certificates(); }, [](const Tally& t) { return t.certified; }},
    {"D", [](const Tally& t) { return t.domain; }, [](const Tally& t) { return t.plans; }},
    {"S", [](const Tally& t) { return t.safety; }, [](const Tally& t) { return t.plans; }}};

std::string Intervals(const std::vector<CellResult>& results, std::ostream& out) {
  std::string text;
  out << fmt::format("{:<12}{:>8}{:>8}{:>8}  {:<18}{:>8}  {}\n", "", "count", "of", "part", "95 % over plans", "mean",
                     "95 % over seeds");
  for (std::size_t g = 0; g < std::size(kGroups); ++g)
    for (const Figure& figure : kFigures) {
      int count = 0, of = 0;
      std::vector<std::optional<double>> parts;
      for (const CellResult& result : results) {
        const int own = figure.count(result[g]), own_of = figure.of(result[g]);
        count += own, of += own_of;
        parts.push_back(own_of > 0 ? std::optional(static_cast<double>(own) / own_of) : std::nullopt);
      }
      const Estimate estimate = EstimateOf(parts);
      const std::optional<Range> plans = WilsonRange(count, of),
                                 seeds = StudentRange(estimate.mean.value_or(0), estimate.deviation, estimate.seeds);
      const auto end = [](const std::optional<Range>& range, double Range::*which) {
        return range ? std::optional((*range).*which) : std::nullopt;
      };
      Line line;
      line << NameOf(kGroups[g]) << figure.name << count << of << end(plans, &Range::low) << end(plans, &Range::high)
           << estimate.seeds << estimate.mean << (estimate.seeds > 1 ? std::optional(estimate.deviation) : std::nullopt)
           << end(seeds, &Range::low) << end(seeds, &Range::high);
      text += line.End();
      const auto shown = [](const std::optional<Range>& range) {
        return range ? fmt::format("{:.4f} to {:.4f}", range->low, range->high) : "";
      };
      if (of == 0) continue;
      out << fmt::format("{} {:<10}{:>8}{:>8}{:>8.4f}  {:<18}{:>8.4f}  {}\n", NameOf(kGroups[g]), figure.name, count,
                         of, static_cast<double>(count) / of, shown(plans), *estimate.mean, shown(seeds));
    }
  return text;
}

const Method& MethodNamed(const std::string& name) {
  std::string all;
  for (const Method& method : Methods()) {
    if (method.name == name) return method;
    all += (all.empty() ? "" : ", ") + method.name;
  }
  throw std::invalid_argument("--method: there is no " + name + "; there are " + all);
}

}  // namespace

const std::vector<File>& FilesOfPlans() {
  static const std::vector<File> files{
      {"scenarios.csv",
       {kSeed,
        kGroup,
        kPlan,
        {"obstacle_x", "center of the obstacle, m"},
        {"obstacle_y", "the same"},
        {"obstacle_radius", "m"},
        {"STATE", "center of X0, one column a state"},
        {"STATE_half_width", "half-width of X0"}}},
      {"controls.csv", {kSeed, kGroup, kPlan, {"step", "t, from 0"}, {"INPUT", "u_t, one column an input"}}},
      {"outcomes.csv",
       {kSeed,
        kGroup,
        kPlan,
        {"answer", "C certified, D, S or F; V where only the method's own budget is in the way"},
        {"step", "at which D or S was decided, else -1"},
        {"safe", "1 if no rollout of the target touches the obstacle"},
        {"complete", "1 if the tube reaches the horizon"},
        {"cover", "whether the tube, as far as it goes, contains every rollout: inside, outside or undecided"},
        {"area", "of the last slice's position, m^2; -1 where the tube is not complete"}}},
      {"intervals.csv",
       {kGroup,
        {"figure", "recall, coverage, certified, false (part of the certificates), D or S"},
        {"count", "plans of all seeds that count"},
        {"of", "of so many"},
        {"plans_low", "Wilson interval of count / of, 95 %: as though plans were independent"},
        {"plans_high", "the same"},
        {"seeds", "that have a value"},
        {"mean", "of the seeds' parts"},
        {"deviation", "their sample standard deviation"},
        {"seeds_low", "Student's interval of the mean, 95 %; may leave [0, 1]"},
        {"seeds_high", "the same"}}}};
  return files;
}

void RunPlans(const PlansOptions& options, std::ostream& out) {
  System system = SystemNamed(options.system);
  system.horizon = options.horizon;
  const Method& method = MethodNamed(options.method);
  std::filesystem::create_directories(options.directory);

  const auto seeds = static_cast<std::size_t>(options.seeds);
  std::vector<Lines> lines(seeds);
  std::vector<CellResult> results(seeds);
  ForEachInParallel(seeds, options.threads, [&](std::size_t i, std::size_t) {
    Cell cell = PaperCell(system, options.observations, 0, options.first_seed + static_cast<int>(i));
    cell.method = method;
    results[i] = RunCell(cell, options.effort, [&](const PlanOutcome& outcome) {
      Describe(system, cell.seed, static_cast<Group>(outcome.group - 'A'), outcome.plan, lines[i]);
      lines[i].outcomes += Describe(cell.seed, outcome);
    });
    SaveTransitions((options.directory / ("transitions-" + std::to_string(cell.seed) + ".csv")).string(), *system.model,
                    MakeData(system, cell.layout, cell.seed, cell.observations, cell.noise));
  });
  const auto write = [&](std::size_t file, const std::function<std::string(const Lines&)>& of) {
    std::string text = HeaderOf(FilesOfPlans()[file], *system.model);
    for (const Lines& each : lines) text += of(each);
    WriteFile(options.directory / FilesOfPlans()[file].name, text);
  };
  write(0, [](const Lines& each) { return each.scenarios; });
  write(1, [](const Lines& each) { return each.controls; });
  write(2, [](const Lines& each) { return each.outcomes; });
  out << options.system << ", " << options.method << ", N = " << options.observations << ", T = " << options.horizon
      << ", seeds " << options.first_seed << " to " << options.first_seed + options.seeds - 1 << "\n";
  WriteFile(options.directory / FilesOfPlans()[3].name,
            HeaderOf(FilesOfPlans()[3], *system.model) + Intervals(results, out));
}

}  // namespace forereach::research
