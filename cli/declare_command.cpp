#include <algorithm>
#include <chrono>
#include <iostream>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "command_line/nearest.h"
#include "command_line/progress.h"
#include "forereach/certify/problem.h"
#include "forereach/declare/region_search.h"
#include "forereach/declare/slope_bound.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/parallel.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "identify/cover_file.h"
#include "identify/declare_between.h"
#include "identify/declare_data.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

struct DeclareArguments {
  std::string config, cover, check;
  std::string from = "equations";
  bool json = false, between = false, from_data = false, rates = false;
  double seconds = BetweenCommand{}.seconds;
  std::string noise = "declared", disturbance = "estimated";
  DataCommand data;
  SlopeBoundOptions search;
  int regions = 1;
  unsigned jobs = AllCores();
};

// A residual of the model, as a task file may write it.
std::string ExampleFor(const NominalModel& model) {
  const std::string& state = model.state_names().back();
  return fmt::format("residual: {{parameters: {{c: [0.1, 0.2]}}, add: {{{}: -c*abs({})}}}}", state, state);
}

Config LoadWithResidual(const std::string& path) {
  Config config = LoadConfig(path, TransitionsFile::kIgnore);
  if (!config.residual)
    throw ConfigError("{}:1: residual: missing: what the robot's next state has beyond the model's; for example  {}",
                      path, ExampleFor(*config.problem->model));
  return config;
}

// ---- declare

constexpr std::size_t kSteps = 100;  // of the progress bar, for each derivative

std::vector<SlopeBound> BoundAll(const Config& config, const DeclareArguments& options) {
  const TextSlopes slopes(*config.residual);
  const std::vector<Interval> parameters = ParameterRanges(*config.residual);
  std::vector<SlopeBound> bounds;
  for (int k = 0; k < slopes.num_states(); ++k)
    for (int l = 0; l < slopes.num_variables(); ++l)
      if (slopes.Occurs(k, l)) bounds.emplace_back().row = k, bounds.back().column = l;
  Progress progress("hundredths of a bound", kSteps * bounds.size());
  ForEachInParallel(bounds.size(), options.jobs, [&](std::size_t i, std::size_t) {
    std::size_t shown = 0;
    const auto show = [&](double closed) {
      for (const auto now = static_cast<std::size_t>(closed * static_cast<double>(kSteps)); shown < now; ++shown)
        progress.Advance();
    };
    bounds[i] =
        BoundSlope(slopes, config.problem->domain, parameters, bounds[i].row, bounds[i].column, options.search, show);
  });
  return bounds;
}

constexpr int kBoundDigits = 10;  // of a bound

// The arguments that the slopes of a row depend on and that are not parameters with one value.
std::vector<std::size_t> FreeArguments(const ResidualSlopes& slopes, const Config& config, int row) {
  const std::vector<Interval> parameters = ParameterRanges(*config.residual);
  const auto num_variables = ToSize(config.problem->model->num_variables());
  std::vector<std::size_t> free;
  for (std::size_t i = 0; i < num_variables + parameters.size(); ++i)
    if (slopes.Occurs(row, static_cast<int>(i)) &&
        (i < num_variables || parameters[i - num_variables].lower < parameters[i - num_variables].upper))
      free.push_back(i);
  return free;
}

template <class Entry>
std::string NameOf(const Entry& entry, const std::vector<std::string>& names) {
  return fmt::format("{} by {}", names[ToSize(entry.row)], names[ToSize(entry.column)]);
}

// Rejects a slope without a finite bound. @throws std::invalid_argument that names the slope and a box.
void RequireFinite(const std::vector<SlopeBound>& bounds, const Config& config, const ResidualSlopes& slopes) {
  const std::vector<std::string> names = ArgumentNames(config);
  for (const SlopeBound& bound : bounds) {
    if (!bound.unbounded.empty()) {
      const std::string box = Joined(FreeArguments(slopes, config, bound.row), [&](std::size_t i) {
        return fmt::format("{} in [{}, {}]", names[i], RoundedDown(bound.unbounded[i].lower, kBoundDigits),
                           RoundedUp(bound.unbounded[i].upper, kBoundDigits));
      });
      throw std::invalid_argument(
          fmt::format("no finite bound for the slope of {}: {} has none over {}, found after {} boxes; take this box "
                      "out of `domain` in {} (narrow its bounds, or add an inequality or ball), narrow the residual's "
                      "parameters, or raise --max-boxes if the box is wide",
                      NameOf(bound, names), config.residual->name, box, bound.boxes, config.path));
    }
    if (std::ranges::all_of(bound.cover.nodes, [](const auto& node) { return node.outside || node.argument >= 0; }))
      throw ConfigError("{}: domain: no point of its box satisfies its inequalities and balls", config.path);
  }
}

// The text for a task file's `declaration`.
std::string Yaml(const std::vector<SlopeBound>& bounds, const std::vector<std::string>& names) {
  std::string text = "lipschitz: {";
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    const bool same_row = i > 0 && bounds[i - 1].row == bounds[i].row;
    if (!same_row) text += fmt::format("{}{}: {{", i > 0 ? "}, " : "", names[ToSize(bounds[i].row)]);
    text += fmt::format("{}{}: {}", same_row ? ", " : "", names[ToSize(bounds[i].column)],
                        RoundedUp(bounds[i].upper, kBoundDigits));
  }
  return text + (bounds.empty() ? "}" : "}}");
}

constexpr int kRegionDigits = 4;
constexpr double kRoom = 1.001;  // --check has to prove what is printed, by boxes of its own

// Cells of the domain with smaller slopes, cut along up to three of the variables of the slopes.
std::vector<Region> RegionsFor(const std::vector<SlopeBound>& bounds, const Config& config,
                               const DeclareArguments& options) {
  const Problem& problem = *config.problem;
  const TextSlopes slopes(*config.residual);
  const std::vector<Interval> ranges = problem.domain.Ranges();
  Eigen::MatrixXd lipschitz = Eigen::MatrixXd::Zero(slopes.num_states(), slopes.num_variables());
  std::vector<int> variables;
  for (const SlopeBound& bound : bounds) lipschitz(bound.row, bound.column) = bound.upper;
  for (int l = 0; l < slopes.num_variables() && variables.size() < Region::kMaxVariables; ++l) {
    Problem one = problem;
    one.declaration.regions = {{{{l, {0, 1}}}, Eigen::MatrixXd::Zero(slopes.num_states(), slopes.num_variables())}};
    const bool matters = std::ranges::any_of(
        bounds, [&](const SlopeBound& bound) { return bound.upper > 0 && slopes.Occurs(bound.row, l); });
    const Interval& range = ranges[ToSize(l)];
    if (matters && range.lower < range.upper && FindCoupledRegion(one).empty()) variables.push_back(l);
  }
  RegionSearchOptions search;
  search.most_cells = ToSize(options.regions);
  return FindRegions(slopes, problem.domain, ParameterRanges(*config.residual), lipschitz, variables, search);
}

// Two lines a region.
std::string Yaml(const std::vector<Region>& regions, const std::vector<SlopeBound>& bounds,
                 const std::vector<std::string>& names) {
  const auto name = [&](int i) { return names[ToSize(i)]; };
  std::string text;
  for (const Region& region : regions) {
    std::string rows;
    const std::string box = Joined(region.box, [&](const auto& side) {
      return fmt::format("{}: [{}, {}]", name(side.variable), ToText(side.range.lower), ToText(side.range.upper));
    });
    for (std::size_t i = 0; i < bounds.size(); ++i) {
      const int row = bounds[i].row, column = bounds[i].column;
      const double whole = bounds[i].upper;
      const double slope = MulUp(kRoom, region.lipschitz(row, column));
      if (i == 0 || bounds[i - 1].row != row) rows += fmt::format("{}{}: {{", i > 0 ? "}, " : "", name(row));
      if (!(slope > 0)) continue;
      if (!rows.ends_with('{')) rows += ", ";
      rows += fmt::format("{}: {}", name(column),
                          slope < whole / kRoom ? RoundedUp(slope, kRegionDigits) : RoundedUp(whole, kBoundDigits));
    }
    text += fmt::format("\n    - in: {{{}}}\n      lipschitz: {{{}}}}}", box, rows);
  }
  return text.empty() ? "" : fmt::format("\n  regions:{}", text);
}

double LargestGap(const std::vector<SlopeBound>& bounds) {
  double gap = 0;
  for (const SlopeBound& bound : bounds) gap = std::max(gap, bound.gap());
  return gap;
}

bool AllReached(const std::vector<SlopeBound>& bounds) {
  return std::ranges::all_of(bounds, [](const SlopeBound& bound) { return bound.reached; });
}

Json ToJson(const std::vector<SlopeBound>& bounds, const std::vector<Region>& regions, const Config& config,
            double seconds) {
  const std::vector<std::string> names = ArgumentNames(config);
  const NominalModel& model = *config.problem->model;
  const auto columns = ToSize(model.num_variables());
  Json zero = Json::array();
  for (int k = 0; k < model.num_states(); ++k) zero.push_back(std::vector<double>(columns, 0.0));
  Json lipschitz = zero, lower = zero, entries = Json::array();
  std::size_t boxes = 0;
  for (const SlopeBound& bound : bounds) {
    const auto row = ToSize(bound.row), column = ToSize(bound.column);
    lipschitz[row][column] = bound.upper;
    lower[row][column] = bound.lower;
    Json point = Json::object();
    for (std::size_t i = 0; i < bound.point.size(); ++i) point[names[i]] = bound.point[i];
    entries.push_back({{"row", names[row]},
                       {"column", names[column]},
                       {"upper", bound.upper},
                       {"lower", bound.lower},
                       {"gap", bound.gap()},
                       {"point", point},
                       {"boxes", bound.boxes},
                       {"reached", bound.reached}});
    boxes += bound.boxes;
  }
  return {{"residual", ResidualJson(config)},
          {"rows", model.state_names()},
          {"columns", std::vector(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(columns))},
          {"lipschitz", lipschitz},
          {"lower", lower},
          {"gap", LargestGap(bounds)},
          {"reached", AllReached(bounds)},
          {"entries", entries},
          {"boxes", boxes},
          {"seconds", seconds},
          {"yaml", Yaml(bounds, names) + Yaml(regions, bounds, names)},
          {"digests",
           {{"config", ToHex(config.grounds.config)},
            {"model", ToHex(config.grounds.model)},
            {"residual", ToHex(ResidualDigest(config))}}}};
}

void PrintForPeople(const std::vector<SlopeBound>& bounds, const std::vector<Region>& regions, const Config& config,
                    double seconds) {
  const TextSlopes slopes(*config.residual);
  const std::vector<std::string> names = ArgumentNames(config);
  const auto line = [](const auto&... cells) {
    return fmt::format("\n  {:<8}{:<8}{:<18}{:<18}{:<10}{:<9}{}", cells...);
  };
  std::string text =
      fmt::format("declare: {} over the domain, {}{}", config.residual->name,
                  AllReached(bounds) ? "to a gap of " : "stopped at a gap of ", RoundedUp(LargestGap(bounds), 2)) +
      line("row", "column", "certified bound", "largest found", "gap", "boxes", " at");
  for (const SlopeBound& bound : bounds) {
    std::string at;
    if (!bound.point.empty())
      for (const std::size_t i : FreeArguments(slopes, config, bound.row))
        at += fmt::format(" {} {:.6g}", names[i], bound.point[i]);
    text += line(names[ToSize(bound.row)], names[ToSize(bound.column)], RoundedUp(bound.upper, kBoundDigits),
                 RoundedDown(bound.lower, kBoundDigits), RoundedUp(bound.gap(), 2), bound.boxes, at);
  }
  std::cout << text << "\n  all other entries are zero\n  took " << seconds << " s\n\ndeclaration:\n  "
            << Yaml(bounds, names) << Yaml(regions, bounds, names) << std::endl;
}

int Declare(const DeclareArguments& options) {
  const Config config = LoadWithResidual(options.config);
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<SlopeBound> bounds = BoundAll(config, options);
  RequireFinite(bounds, config, TextSlopes(*config.residual));
  const std::vector<Region> regions = options.regions > 1 ? RegionsFor(bounds, config, options) : std::vector<Region>();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!options.cover.empty()) {
    std::vector<verifier::SlopeClaim> claims;
    for (const SlopeBound& bound : bounds) claims.push_back({bound.row, bound.column, bound.upper, bound.cover});
    SaveCover(options.cover, config, claims);
  }
  if (options.json)
    std::cout << JsonText(ToJson(bounds, regions, config, seconds)) << std::endl;
  else
    PrintForPeople(bounds, regions, config, seconds);
  return AllReached(bounds) ? 0 : 1;
}

// ---- declare --check

struct CoverFinding {
  verifier::Answer answer = verifier::Answer::kYes;
  std::string entry, what;
};

// The checks without mathematics: the record is complete, belongs to this task, and has each entry once.
std::vector<CoverFinding> CheckRecord(const CoverFile& file, const Config& config,
                                      const verifier::CoverChecker& checker) {
  std::vector<CoverFinding> findings;
  const auto refute = [&](std::string entry, std::string what) {
    findings.push_back({verifier::Answer::kNo, std::move(entry), std::move(what)});
  };
  if (file.cover_digest != ToHex(CoverDigest(file.claims)))
    refute("", "the cover was altered after it was made: its digest differs");
  if (file.residual_digest != ToHex(ResidualDigest(config)))
    refute("", "the cover was made for another domain, residual or parameters than the task's");
  const std::vector<std::string> names = ArgumentNames(config);
  for (const auto& [row, column] : checker.Entries()) {
    const auto count = std::ranges::count_if(
        file.claims, [&, k = row, l = column](const auto& claim) { return claim.row == k && claim.column == l; });
    // With none, the slope is not proven; with two, it is not said which of them is declared.
    if (count != 1)
      refute(fmt::format("{} by {}", names[ToSize(row)], names[ToSize(column)]),
             fmt::format("stands {} times in the cover, has to stand once", count));
  }
  return findings;
}

std::vector<CoverFinding> CheckClaims(const CoverFile& file, const Config& config,
                                      const verifier::CoverChecker& checker, unsigned jobs) {
  const std::vector<std::string> names = ArgumentNames(config);
  std::vector<CoverFinding> findings(file.claims.size());
  std::size_t leaves = 0;
  for (const auto& claim : file.claims)
    leaves +=
        ToSize(std::ranges::count_if(claim.cover.nodes, [](const Cover::Node& node) { return node.argument < 0; }));
  Progress progress("boxes checked", leaves);
  ForEachInParallel(file.claims.size(), jobs, [&](std::size_t i, std::size_t) {
    const verifier::SlopeClaim& claim = file.claims[i];
    const verifier::CoverVerdict verdict = checker.Check(claim, [&] { progress.Advance(); });
    findings[i] = {verdict.answer, NameOf(claim, names), verdict.what};
  });
  return findings;
}

// The regions that the task declares: each slope of each, over its box, by the checker's own cuts.
std::vector<CoverFinding> CheckRegions(const Config& config, std::size_t& count) {
  const Problem& problem = *config.problem;
  const std::vector<std::string> names = ArgumentNames(config);
  std::vector<CoverFinding> findings;
  for (std::size_t i = 0; i < problem.declaration.regions.size(); ++i) {
    const Region& region = problem.declaration.regions[i];
    const std::optional<Domain> part = PartIn(problem.domain, region);
    // Outside of the domain nothing is claimed.
    if (!part) continue;
    if (region.bound.size() > 0)
      findings.push_back({verifier::Answer::kUnknown, fmt::format("declaration.regions[{}].bound", i),
                          "nothing is proven of it here, only of slopes"});
    const verifier::CoverChecker checker(*part, *config.residual);
    for (const auto& [row, column] : checker.Entries()) {
      const double slope = region.lipschitz(row, column);
      // The claim for the whole domain says it already.
      if (!(slope < problem.declaration.lipschitz(row, column))) continue;
      const verifier::SlopeClaim claim{row, column, slope, {{Cover::Node{.number = slope}}}};
      const verifier::CoverVerdict verdict = checker.Check(claim);
      ++count;
      findings.push_back(
          {verdict.answer, fmt::format("declaration.regions[{}]: {}", i, NameOf(claim, names)), verdict.what});
    }
  }
  return findings;
}

int CheckCover(const DeclareArguments& options) {
  const Config config = LoadWithResidual(options.config);
  const CoverFile file = LoadCover(options.check, config);
  const verifier::CoverChecker checker(config.problem->domain, *config.residual);
  std::vector<CoverFinding> findings = CheckRecord(file, config, checker);
  std::ranges::move(CheckClaims(file, config, checker, options.jobs), std::back_inserter(findings));
  std::size_t count = file.claims.size();
  std::ranges::move(CheckRegions(config, count), std::back_inserter(findings));
  std::erase_if(findings, [](const CoverFinding& finding) { return finding.answer == verifier::Answer::kYes; });

  const bool refuted = std::ranges::any_of(
      findings, [](const CoverFinding& finding) { return finding.answer == verifier::Answer::kNo; });
  const std::string unknown = options.json ? "cannot_verify" : "cannot verify";
  const std::string verdict = refuted ? "refuted" : findings.empty() ? "confirmed" : unknown;
  if (options.json) {
    Json document{{"verdict", verdict}, {"entries", count}, {"failures", Json::array()}};
    for (const CoverFinding& finding : findings)
      document["failures"].push_back({{"entry", finding.entry}, {"claim", finding.what}});
    std::cout << JsonText(document) << std::endl;
  } else {
    for (const CoverFinding& finding : findings)
      std::cout << "  " << finding.entry << (finding.entry.empty() ? "" : ": ") << finding.what << "\n";
    std::cout << "check: " << verdict << ": " << count << " bounds of " << config.residual->name << std::endl;
  }
  return findings.empty() ? 0 : 1;
}

}  // namespace

Command DeclareCommand() {
  const auto options = std::make_shared<DeclareArguments>();
  return {
      .name = "declare",
      .footer =
          R"(In the task file, `add` is what the next state has beyond the model's. Each parameter is a number or an interval:
  residual: {parameters: {c: [0.1, 0.2]}, add: {v: -c*v*abs(v)}}
Boxes are cut until the bound over every one, in interval arithmetic, is close to the largest slope found.
Copy the last line of the output into the task file.

--between needs no residual. It bounds how far the robot's path curves from one sample to the next, for the key
task.between.

--from-data needs no residual either. It proposes a declaration from the task's transitions, and proves nothing; see
docs/data.md. It says after how many transitions each row is refuted, as affine and as slopes, and adds a text with
affine rows, perhaps with a rest, where the transitions allow it. With --hold-out it shows how often fresh transitions
contradict what the others propose.

Examples:
  forereach declare --config config/bicycle.yaml
  forereach declare --config config/bicycle.yaml --regions 64
  forereach declare --config config/bicycle.yaml --cover cover.json
  forereach declare --config config/bicycle.yaml --check cover.json
  forereach declare --config config/demo.yaml --between
  forereach declare --config config/drive/unicycle.yaml --from-data --by v,omega,a,alpha
  forereach declare --config config/drive/unicycle.yaml --from-data --by v,omega,a,alpha --hold-out --picture trade_off)",
      .options =
          {TaskOption(options->config, "Task file (YAML) with a section `residual`"),
           {"--gap", &options->search.gap, "",
            "Stop when no bound exceeds the largest slope found by more than this fraction", NumberRange{1e-12, 1e3}},
           {"--max-boxes", &options->search.max_boxes, "",
            "Stop after this many boxes for each bound; the bound found by then is valid", NumberRange{1, 100'000'000}},
           {"--regions", &options->regions, "",
            "Also cut the domain into up to so many cells, where that pays, with proven slopes in each; with "
            "--from-data up to 256, with what their transitions need of a disturbance",
            NumberRange{1, 1024}},
           Excluding("--between", {"--cover", &options->cover, "FILE.json",
                                   "The file for the proof: the boxes, and a bound for each"}),
           Excluding("--cover", {"--check", &options->check, "FILE.json",
                                 "Check such a file instead, in 128 bits and with independent formulas: exit 0 "
                                 "confirmed, 1 not confirmed"}),
           Excluding("--check", {"--between", &options->between, "", "Bound the motion between two samples instead"}),
           Needing("--between",
                   OneOf({"equations", "positions"},
                         {"--from", &options->from, "",
                          "With --between. equations: proven bounds over the domain, from the model's equations in "
                          "continuous time; positions: largest second differences of the task's transitions"})),
           Needing("--between", {"--seconds", &options->seconds, "",
                                 "With --between: the bounds found by then, or by Ctrl-C, are printed; they are valid",
                                 NumberRange{0.1, 1e6}}),
           Needing("--between", {"--rates", &options->rates, "",
                                 "With --between: also how fast each state moves, for model.rate_bound, proven from "
                                 "the equations and confirmed by the verifier"}),
           Excluding("--between", {"--from-data", &options->from_data, "",
                                   "Propose a declaration from the task's transitions instead"}),
           Needing("--from-data", {"--by", &options->data.by, "[STATE=]NAMES",
                                   "The states and inputs on which the residual may depend, with commas between, of "
                                   "one state or of all; by default on all. May be repeated"}),
           Needing("--from-data",
                   {"--factor", &options->data.factor, "",
                    "Proposed slopes over the smallest ones that no transitions contradict", NumberRange{1, 1000}}),
           Needing("--from-data",
                   OneOf({"declared", "estimated"},
                         {"--noise", &options->noise, "",
                          "The task's noise_bound, or that raised to what the transitions show of their error"})),
           Needing("--from-data",
                   OneOf({"declared", "estimated"},
                         {"--disturbance", &options->disturbance, "",
                          "The task's disturbance, or that raised to the scatter beyond noise_bound of near places"})),
           Needing("--from-data", {"--hold-out", &options->data.hold_out, "",
                                   "Learn from every other block of time, and judge by those between"}),
           Needing("--hold-out", {"--blocks", &options->data.blocks, "", "With --hold-out: the number of blocks",
                                  NumberRange{2, 100'000}}),
           Needing("--hold-out",
                   {"--steps", &options->data.steps, "",
                    "With --hold-out: the length of the stretches of recorded commands that are certified",
                    NumberRange{1, kMaxSteps}}),
           Needing("--hold-out", {"--confidence", &options->data.confidence, "",
                                  "With --hold-out: of the bound on the rate of blocks with a contradiction",
                                  NumberRange{0.5, 0.999999}}),
           Needing("--from-data", {"--picture", &options->data.picture, "NAME",
                                   "The smallest slopes against the error, or with --hold-out the trade-off, as "
                                   "NAME.svg and NAME.png, or as one of them"}),
           JobsOption(options->jobs),
           JsonFlag(options->json, "One JSON document on standard output; the matrix is `lipschitz`")},
      .run = [options] {
        if (options->between)
          return DeclareBetween({options->config, options->from == "positions", options->json, options->rates,
                                 options->search, options->seconds});
        if (options->from_data) {
          DataCommand& data = options->data;
          data.config = options->config;
          data.estimate_noise = options->noise == "estimated";
          data.estimate_disturbance = options->disturbance == "estimated";
          data.json = options->json;
          data.jobs = options->jobs;
          data.regions = options->regions;
          if (data.regions > 1 && data.hold_out)
            throw ConfigError("--regions: --hold-out judges what holds in the whole domain");
          if (data.regions > static_cast<int>(Region::kMaxRegions))
            throw ConfigError("--regions: has to be at most 256 with --from-data");
          return data.hold_out ? DeclareHoldOut(data) : DeclareFromData(data);
        }
        return options->check.empty() ? Declare(*options) : CheckCover(*options);
      }};
}

}  // namespace forereach
