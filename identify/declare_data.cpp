#include "identify/declare_data.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "command_line/nearest.h"
#include "command_line/progress.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/observations.h"
#include "identify/affine_proposal.h"
#include "identify/calm_regions.h"
#include "identify/declare_by.h"
#include "identify/noise_floor.h"
#include "identify/smallest_row.h"
#include "records/chart.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

constexpr int kTableDigits = 4;  // of a number in the table

// A line of the transitions' file: its header is line 1.
int LineOf(const Config& config, int observation) { return config.rows[ToSize(observation)] + 2; }

// Of a table: cells of twelve letters, and the last as it is.
std::string Line(const std::vector<std::string>& cells) {
  std::string text = "  ";
  for (const std::string& cell : cells) text += fmt::format("{:<{}}", cell, &cell == &cells.back() ? 0 : 12);
  return text + "\n";
}

std::string LinesOf(const Config& config, int first, int second) {
  return fmt::format("lines {} and {}", LineOf(config, first), LineOf(config, second));
}

// ---- for people

void PrintSlopes(const ProposedDeclaration& proposal, const Config& config, std::ostream& out) {
  const std::vector<std::string> names = config.problem->model->variable_names();
  out << Line({"row", "column", "smallest", "at least", "proposed", "because of"});
  for (std::size_t k = 0; k < proposal.rows.size(); ++k)
    for (std::size_t l = 0; l < names.size(); ++l) {
      const auto row = static_cast<Eigen::Index>(k), column = static_cast<Eigen::Index>(l);
      const double proposed = proposal.declaration.lipschitz(row, column);
      if (!(proposed > 0)) continue;
      const ProposedRow& found = proposal.rows[k];
      const auto& reason = found.smallest.reasons[l];
      out << Line({names[k], names[l], RoundedUp(found.smallest.slopes[column], kTableDigits),
                   RoundedDown(found.least[column], kTableDigits), ToText(proposed),
                   reason ? LinesOf(config, reason->first, reason->second) : ""});
    }
  if (proposal.declaration.lipschitz.maxCoeff() == 0) out << "  no slopes are needed\n";
}

// By row of the Lipschitz matrix, then by column.
using LoneSlopes = std::vector<std::vector<LoneSlope>>;

void PrintLoneSlopes(const LoneSlopes& rows, const Config& config, std::ostream& out) {
  const std::vector<std::string> names = config.problem->model->variable_names();
  int flat = 0;
  std::string table;
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (std::size_t l = 0; l < names.size(); ++l) {
      const LoneSlope& lone = rows[k][l];
      flat += lone.pairs > 0 && !(lone.slope > 0);
      if (lone.slope > 0)
        table += Line({names[k], names[l], RoundedDown(lone.slope, kTableDigits), std::to_string(lone.pairs),
                       LinesOf(config, lone.first, lone.second)});
    }
  if (!table.empty()) out << "\n" << Line({"row", "column", "alone", "pairs", "the largest in"}) << table;
  if (flat > 0)
    out << (table.empty() ? "\n  " : "  ") << "In " << flat << (table.empty() ? "" : " further")
        << (flat == 1 ? " entry" : " entries") << ", pairs that differ in one column alone show no slope.\n";
}

void PrintErrors(const ProposedDeclaration& proposal, const NominalModel& model, std::ostream& out) {
  out << "\n" << Line({"row", "noise_bound", "  knee", "  repeated", "  deviation", "  Strongin", "  Knuth-Chou"});
  for (std::size_t k = 0; k < proposal.rows.size(); ++k) {
    const ProposedRow& row = proposal.rows[k];
    std::vector<std::string> cells{model.state_names()[k],
                                   ToText(proposal.declaration.noise_bound[static_cast<Eigen::Index>(k)]),
                                   "  " + RoundedUp(row.knee, kTableDigits),
                                   "  " + RoundedDown(row.noise.repeated, kTableDigits),
                                   "  " + RoundedDown(row.noise.deviation, kTableDigits),
                                   ""};
    if (row.strongin > 0)
      cells.back() = fmt::format("  {:<10}  x {}", "x " + RoundedUp(row.strongin, 3), RoundedUp(row.knuth_chou, 3));
    out << Line(cells);
  }
}

// As it is if it is short, like one that was declared.
std::string ErrorText(double error) {
  constexpr std::size_t kShort = 8;
  const std::string text = ToText(error);
  return text.size() <= kShort ? text : RoundedUp(error, kTableDigits);
}

std::string NameOfError(const ProposedRow& row) { return row.is_raised ? "with the noise raised" : "declared"; }

// Whether the declared error is at the cliff or below it.
bool IsNearKnee(const ProposedRow& row, double factor) { return row.declared < factor * row.knee; }

// The smallest slopes against the error, of the rows whose declared error may be off the cliff.
void PrintTrades(const ProposedDeclaration& proposal, const NominalModel& model, double factor, std::ostream& out) {
  const std::vector<std::string> names = model.variable_names();
  const auto line = [](const auto&... cells) { return fmt::format("  {:<12}{:<12}{}\n", cells...); };
  std::string table;
  for (std::size_t k = 0; k < proposal.rows.size(); ++k) {
    const ProposedRow& row = proposal.rows[k];
    if (!IsNearKnee(row, factor)) continue;
    std::vector<ProposedRow::Trade> trades = row.trades;
    trades.push_back({row.proposed, row.smallest.slopes});
    std::ranges::stable_sort(trades, {}, &ProposedRow::Trade::error);
    for (std::size_t i = 0; i < trades.size(); ++i) {
      const double error = trades[i].error;
      if (i > 0 && trades[i - 1].error == error) continue;
      const std::string slopes = !trades[i].slopes ? "" : Joined(names, [&](const std::string& name) {
        const double slope = (*trades[i].slopes)[&name - names.data()];
        return slope > 0 ? fmt::format("{} {}", name, RoundedUp(slope, kTableDigits)) : "";
      });
      std::string notes;
      for (const auto& [noted, note] :
           {std::pair(row.declared, NameOfError(row)), {row.knee, "the knee"}, {row.proposed, "proposed"}})
        if (noted == error) notes += (notes.empty() ? "  <- " : ", ") + note;
      table += line(names[k], ErrorText(error),
                    (!trades[i].slopes ? "none are consistent"
                     : slopes.empty()  ? "none are needed"
                                       : slopes) +
                        notes);
    }
  }
  if (!table.empty()) out << "\n" << line("row", "error", "smallest slopes") << table;
}

// The rows' slopes against the error, those closest to their knee if there are more than a chart has colours for.
Chart SlopeChartOf(const ProposedDeclaration& proposal, const NominalModel& model, const Eigen::RowVectorXd& scales) {
  constexpr std::size_t kMost = 6;
  std::vector<std::size_t> shown;
  for (std::size_t k = 0; k < proposal.rows.size(); ++k)
    if (proposal.rows[k].knee > 0) shown.push_back(k);
  std::ranges::stable_sort(shown, {}, [&](std::size_t k) { return proposal.rows[k].declared / proposal.rows[k].knee; });
  shown.resize(std::min(shown.size(), kMost));
  if (shown.empty())
    throw PictureError("picture: near places show no error, so there are no slopes to draw against it");
  Chart chart{.title = "The smallest slopes against the error that is declared",
              .x_name = "error (noise_bound + disturbance) in multiples of the knee",
              .y_name = "% of the steepest",
              .x = {ProposedRow::kShares.begin(), ProposedRow::kShares.end()},
              .series = {}};
  for (const std::size_t k : shown) {
    const ProposedRow& row = proposal.rows[k];
    Chart::Series& series = chart.series.emplace_back();
    series.name = fmt::format("{}: knee at {}, {} {}", model.state_names()[k], RoundedUp(row.knee, kTableDigits),
                              NameOfError(row), ErrorText(row.declared));
    double steepest = 0;
    for (std::size_t i = 0; i < ProposedRow::kShares.size(); ++i) {
      const auto& slopes = row.trades[i].slopes;
      series.y.push_back(slopes ? slopes->dot(scales) : std::numeric_limits<double>::quiet_NaN());
      steepest = std::fmax(steepest, series.y.back());
    }
    for (double& y : series.y) y *= steepest > 0 ? 100 / steepest : 1;
  }
  return chart;
}

// Rows whose declared error is below what the data show of it.
std::vector<std::string> TooQuiet(const ProposedDeclaration& proposal, const NominalModel& model) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < proposal.rows.size(); ++k)
    if (const auto i = static_cast<Eigen::Index>(k);
        !proposal.declaration.Grows(i) && proposal.rows[k].proposed < proposal.rows[k].noise.deviation)
      names.push_back(model.state_names()[k]);
  return names;
}

void PrintMeaning(const ProposedDeclaration& proposal, const NominalModel& model, const DataCommand& command,
                  std::ostream& out) {
  std::vector<std::string> constant, scattered, steep, close;
  for (const int l : proposal.constant) constant.push_back(model.variable_names()[ToSize(l)]);
  for (std::size_t k = 0; k < proposal.rows.size(); ++k)
    if (const ProposedRow& row = proposal.rows[k]; IsNearKnee(row, command.factor))
      (!(row.scatter > 0) ? close : command.estimate_disturbance ? scattered : steep).push_back(model.state_names()[k]);
  out << "\nsmallest: the slopes with the least sum, each weighed by its column's standard deviation, that no two "
         "transitions\n  contradict. Every smaller sum is contradicted; the lines are a pair that needs the slope.\n"
         "at least: no smaller slope is possible there, if the row's other slopes are at most the proposed ones.\n"
         "alone: the largest slope of two transitions that hardly differ in another column. No bound: the others have "
         "a part in it.\n"
         "proposed: "
      << ToText(command.factor)
      << " times the smallest (--factor). No two transitions contradict it.\n"
         "knee: the least error, noise_bound + disturbance, with which near places (a tenth of the columns' standard "
         "deviations\n  apart) need no slope. With less, slopes are steep.\n"
         "repeated: half the largest difference of transitions that agree in all columns; the error is at least that.\n"
         "deviation: an estimate of the error's standard deviation from near neighbours (Gamma test).\n"
         "Strongin, Knuth-Chou: what these estimators say of a row, as factors of the smallest. They ignore "
         "noise_bound.\n"
         "\nNothing of this is proven. Transitions can refute a declaration; they cannot show that it holds where the "
         "robot\nhas not been. A slope of zero says that the residual does not depend on that column at all, and it is "
         "proposed\nwherever no pair of transitions needs more. "
      << (command.estimate_noise ? "noise_bound is raised to what these transitions show.\n"
          : scattered.empty()    ? "noise_bound and disturbance are taken from the task, not learned.\n"
                                 : "noise_bound is taken from the task, not learned.\n");
  if (!scattered.empty())
    out << "Scatter: at near places, residuals differ by more than noise_bound explains: " << Joined(scattered)
        << ". Proposed is " << ToText(command.factor)
        << " times what the knee\n  has beyond it, as a disturbance: the robot may do so again in every step. If it is "
           "the sensor that errs by so much,\n  declare noise_bound instead; noise that is too large makes tubes too "
           "narrow.\n";
  if (!steep.empty())
    out << "The error is below the knee, and these slopes are a cliff: " << Joined(steep)
        << ". --disturbance estimated proposes the knee's.\n";
  if (!close.empty())
    out << "The error is at the knee or above it, by less than a factor of " << ToText(command.factor) << ": "
        << Joined(close)
        << ". It is proposed as it is;\n  less would be a cliff, and the knee of more data lies higher.\n";
  if (!constant.empty())
    out << "Never varied in these transitions, so that nothing is known of their slopes: " << Joined(constant) << ".\n";
  if (const auto names = TooQuiet(proposal, model); !names.empty())
    out << "The error that near neighbours show is larger than noise_bound and disturbance allow: " << Joined(names)
        << ".\n  The slopes then explain what is none. Declare a disturbance, or the error that your sensors have.\n";
  out << "How often fresh transitions contradict such a declaration: --hold-out.\n";
}

// Cells with less disturbance. None if two transitions contradict them.
std::vector<CalmRegion> RegionsFor(const Problem& problem, Declaration& proposed, const ProposalOptions& options,
                                   int most) {
  std::vector<int> variables;
  for (const std::vector<int>& columns : options.columns)
    for (const int l : columns) {
      Problem one = problem;
      one.declaration.regions = {{{{l, {0, 1}}}, proposed.lipschitz, proposed.noise_bound}};
      const bool varies = problem.transitions.z.col(l).minCoeff() < problem.transitions.z.col(l).maxCoeff();
      if (varies && std::ranges::count(variables, l) == 0 && FindCoupledRegion(one).empty() &&
          FindTurningRegion(one).empty())
        variables.push_back(l);
    }
  Problem with = problem;
  with.declaration = proposed;
  std::vector<CalmRegion> found = FindCalmRegions(proposed, ObserveForProposal(with, problem.transitions), variables,
                                                  {.most_cells = most, .factor = options.factor});
  for (const CalmRegion& calm : found) with.declaration.regions.push_back(calm.region);
  if (FindViolation(with.declaration, ObserveForProposal(with, problem.transitions))) return {};
  proposed.regions = with.declaration.regions;
  return found;
}

void PrintRegions(const std::vector<CalmRegion>& regions, const DataCommand& command, std::ostream& out) {
  if (command.regions <= 1) return;
  if (regions.empty()) out << "No region needs less disturbance than the whole domain.\n";
  for (std::size_t i = 0; i < regions.size(); ++i)
    out << (i == 0 ? fmt::format("Transitions in each region, whose disturbance is {} times what they need there: ",
                                 ToText(command.factor))
                   : ", ")
        << regions[i].observations << (i + 1 == regions.size() ? ".\n" : "");
}

void Warn(const HeldOutSteps& found) {
  if (const std::string warning = WarningOf(found); !warning.empty())
    std::cerr << "forereach: warning: " << warning << std::endl;
}

// ---- affine rows

std::string LinesOf(const Config& config, const Refutation& found) {
  return Joined(found.by, [&](int i) { return std::to_string(LineOf(config, i)); });
}

void PrintAffine(const AffineProposal& affine, const Config& config, const DataCommand& command, std::ostream& out) {
  const std::vector<std::string>& states = config.problem->model->state_names();
  const auto line = [](const auto&... cells) { return fmt::format("  {:<12}{:<44}{}\n", cells...); };
  const auto when = [&](const std::optional<Refutation>& found) {
    return !found ? "not refuted" : fmt::format("refuted by {}: lines {}", found->after, LinesOf(config, *found));
  };
  for (const JudgedRow& row : affine.rows)
    out << (&row == affine.rows.data() ? "\n" + line("row", "as affine", "as slopes, by the first half") : "")
        << line(states[ToSize(row.row)],
                when(row.affine) + (row.affine ? fmt::format("; rest {}", RoundedUp(row.rest_share, 2)) : ""),
                when(row.lipschitz));
  if (!affine.rows.empty())
    out << "\nas affine: after so many transitions, in their order, no M z + b agrees with them within noise_bound and "
           "disturbance;\n  the lines alone show it. rest: the slopes of what a plane leaves, over those of the row.\n"
           "as slopes, by the first half: after so many, a pair contradicts "
        << ToText(command.factor) << " times the smallest slopes of the first half.\n";
  if (!affine.why_none.empty()) out << "No affine rows are proposed: " << affine.why_none << ".\n";
}

// The declaration with affine rows, if there are any, and what the held-out steps say of both.
void PrintAffineText(const AffineProposal& affine, const HeldOutSteps& slopes, const HeldOutSteps& held_out,
                     const NominalModel& model, std::ostream& out) {
  if (affine.declaration.affine.rows.empty()) return;
  out << "\nOr with affine rows, which no transition refutes.";
  if (held_out.slices() > 0)
    out << " As above: " << TextOf(held_out) << ".\nA position is then known to " << RoundedUp(held_out.half_width, 3)
        << " after " << held_out.steps << " steps, in the median; with slopes to " << RoundedUp(slopes.half_width, 3)
        << ".";
  out << "\n\ndeclaration:\n" << DeclarationYaml(affine.declaration, model) << std::flush;
}

Json ToJson(const AffineProposal& affine, const HeldOutSteps& slopes, const HeldOutSteps& held_out,
            const Config& config) {
  const NominalModel& model = *config.problem->model;
  Json document{{"columns", Json::array()}, {"rows", Json::array()}, {"yaml", nullptr}, {"why_none", affine.why_none}};
  for (const int l : affine.columns) document["columns"].push_back(model.variable_names()[ToSize(l)]);
  const auto when = [&](const std::optional<Refutation>& found) {
    Json json;
    if (!found) return json;
    json = {{"after", found->after}, {"lines", Json::array()}};
    for (const int i : found->by) json["lines"].push_back(LineOf(config, i));
    return json;
  };
  for (const JudgedRow& row : affine.rows)
    document["rows"].push_back({{"state", model.state_names()[ToSize(row.row)]},
                                {"affine_refuted", when(row.affine)},
                                {"slopes_refuted", when(row.lipschitz)},
                                {"rest", row.rest_share}});
  if (affine.declaration.affine.rows.empty()) return document;
  document["yaml"] = "declaration:\n" + DeclarationYaml(affine.declaration, model);
  document["held_out"] = ToJson(held_out);
  document["half_width"] = held_out.half_width;
  document["half_width_by_slopes"] = slopes.half_width;
  return document;
}

// ---- for programs

Json TradesJson(const ProposedRow& row) {
  Json trades = Json::array();
  for (const ProposedRow::Trade& trade : row.trades)
    trades.push_back({{"error", trade.error}, {"slopes", trade.slopes ? Json(*trade.slopes) : Json(nullptr)}});
  return trades;
}

Json ToJson(const ProposedDeclaration& proposal, const LoneSlopes& lone_slopes, const Config& config,
            const DataCommand& command) {
  const NominalModel& model = *config.problem->model;
  const std::vector<std::string> names = model.variable_names();
  Json document{{"proven", false},
                {"transitions", config.problem->transitions.size()},
                {"factor", command.factor},
                {"yaml", "declaration:\n" + DeclarationYaml(proposal.declaration, model)},
                {"entries", Json::array()},
                {"alone", Json::array()},
                {"rows", Json::array()},
                {"never_varied", Json::array()},
                {"digests", {{"config", ToHex(config.grounds.config)}, {"model", ToHex(config.grounds.model)}}}};
  for (const int l : proposal.constant) document["never_varied"].push_back(names[ToSize(l)]);
  for (std::size_t k = 0; k < proposal.rows.size(); ++k) {
    const ProposedRow& row = proposal.rows[k];
    const auto at = static_cast<Eigen::Index>(k);
    document["lipschitz"].push_back(Eigen::RowVectorXd(proposal.declaration.lipschitz.row(at)));
    document["rows"].push_back({{"state", names[k]},
                                {"noise_bound", proposal.declaration.noise_bound[at]},
                                {"disturbance", proposal.declaration.DisturbanceBound(at)},
                                {"knee", row.knee},
                                {"scatter", row.scatter},
                                {"trades", TradesJson(row)},
                                {"repeated", row.noise.repeated},
                                {"deviation", row.noise.deviation},
                                {"strongin", row.strongin},
                                {"knuth_chou", row.knuth_chou}});
    for (std::size_t l = 0; l < names.size(); ++l) {
      const auto column = static_cast<Eigen::Index>(l);
      const LoneSlope& lone = lone_slopes[k][l];
      document["alone"].push_back(
          {{"row", names[k]},
           {"column", names[l]},
           {"pairs", lone.pairs},
           {"slope", lone.slope},
           {"lines", lone.slope > 0 ? Json({LineOf(config, lone.first), LineOf(config, lone.second)}) : Json()}});
      if (!(proposal.declaration.lipschitz(at, column) > 0)) continue;
      Json entry{{"row", names[k]},
                 {"column", names[l]},
                 {"smallest", row.smallest.slopes[column]},
                 {"at_least", row.least[column]},
                 {"proposed", proposal.declaration.lipschitz(at, column)},
                 {"lines", nullptr}};
      if (const auto& reason = row.smallest.reasons[l])
        entry["lines"] = {LineOf(config, reason->first), LineOf(config, reason->second)};
      document["entries"].push_back(entry);
    }
  }
  return document;
}

}  // namespace

int DeclareFromData(const DataCommand& command) {
  const auto pictures = command.picture.empty() ? std::vector<std::string>() : PictureFiles(command.picture);
  const Config config = LoadForSlopes(command.config);
  const Problem& problem = *config.problem;
  std::optional<Progress> progress(std::in_place, "parts of the work", 2 * ToSize(problem.model->num_states()));
  const ProposalOptions options{command.factor,
                                command.estimate_noise,
                                command.estimate_disturbance,
                                ColumnsBy(command.by, *problem.model),
                                [&] { progress->Advance(); },
                                true};
  try {
    const Observations observations = ObserveForProposal(problem, problem.transitions);
    ProposedDeclaration proposal = Propose(problem.declaration, observations, options);
    std::vector<CalmRegion> regions;
    if (command.regions > 1) regions = RegionsFor(problem, proposal.declaration, options, command.regions);
    progress.reset();
    LoneSlopes lone_slopes;
    for (int k = 0; k < problem.model->num_states(); ++k)
      lone_slopes.push_back(FindLoneSlopes(proposal.declaration, observations, k, options.columns[ToSize(k)]));
    const HeldOutSteps held_out = JudgeByHeldOut(config, proposal.declaration, command.jobs);
    const AffineProposal affine = ProposeAffine(problem, observations, proposal, options);
    const HeldOutSteps by_affine = affine.declaration.affine.rows.empty()
                                       ? HeldOutSteps{}
                                       : JudgeByHeldOut(config, affine.declaration, command.jobs);
    if (command.json) {
      Json document = ToJson(proposal, lone_slopes, config, command);
      document["held_out"] = ToJson(held_out);
      document["affine"] = ToJson(affine, held_out, by_affine, config);
      std::cout << JsonText(document) << std::endl;
    } else {
      std::ostream& out = std::cout;
      out << "declare: from " << problem.transitions.size() << " transitions, an estimate and no proof\n";
      PrintSlopes(proposal, config, out);
      PrintLoneSlopes(lone_slopes, config, out);
      PrintErrors(proposal, *problem.model, out);
      PrintTrades(proposal, *problem.model, command.factor, out);
      PrintMeaning(proposal, *problem.model, command, out);
      PrintRegions(regions, command, out);
      PrintAffine(affine, config, command, out);
      if (held_out.slices() > 0) out << "With every other block of time as observations: " << TextOf(held_out) << ".\n";
      out << "\ndeclaration:\n" << DeclarationYaml(proposal.declaration, *problem.model) << std::flush;
      PrintAffineText(affine, held_out, by_affine, *problem.model, out);
    }
    Warn(held_out);
    for (const std::string& file : pictures)
      DrawChart(SlopeChartOf(proposal, *problem.model, ScalesOf(observations)), file);
    return 0;
  } catch (const Unexplained& found) {
    progress.reset();
    std::cerr << "forereach: " << config.path << ": lines " << LineOf(config, found.pair.first) << " and "
              << LineOf(config, found.pair.second) << " of the transitions: " << Explain(found, config, options)
              << std::endl;
    return 1;
  }
}

}  // namespace forereach
