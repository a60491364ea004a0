#include "forereach/certify/explain.h"

#include <optional>
#include <vector>

#include <cmath>

#include "forereach/certify/certifier.h"
#include "forereach/certify/rates.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/unbounded.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

std::string VariableName(const NominalModel& model, int index) {
  if (index < 0 || index >= model.num_variables()) return "coordinate " + std::to_string(index);
  return model.variable_names()[ToSize(index)];
}

// What is reached, rounded away from its bound. The bound is shown as it was given.
std::string Beyond(double reached, bool is_below) { return is_below ? RoundedDown(reached) : RoundedUp(reached); }

std::string ExplainExit(const DomainExit& exit, const NominalModel& model) {
  using Exit = DomainExit::Kind;
  const std::string value = Beyond(exit.value, exit.kind == Exit::kLower), bound = ToText(exit.bound);
  switch (exit.kind) {
    case Exit::kLower: return VariableName(model, exit.index) + " reaches " + value + ", below its bound " + bound;
    case Exit::kUpper: return VariableName(model, exit.index) + " reaches " + value + ", above its bound " + bound;
    case Exit::kInequality:
      return "inequality " + std::to_string(exit.index) + " reaches " + value + ", above its bound " + bound;
    case Exit::kBall:
      return "ball " + std::to_string(exit.index) + ": distance reaches " + value + ", above its radius " + bound;
    case Exit::kNone: break;
  }
  return "no constraint of the domain is violated";
}

// "for v in [0, 4], delta in [-1, 1]".
std::string BoxText(const std::vector<Region>& regions, int i, const NominalModel& model) {
  std::string text;
  for (std::size_t s = 0; ToSize(i) < regions.size() && s < regions[ToSize(i)].box.size(); ++s) {
    const auto& [variable, range] = regions[ToSize(i)].box[s];
    text += (s == 0 ? "for " : ", ") + VariableName(model, variable) + " in [" + ToText(range.lower) + ", " +
            ToText(range.upper) + "]";
  }
  return text;
}

// Whether observations contradict an affine row; false if a step finds its set empty.
bool IsOfAffineRow(const Decision& decision, const Problem& problem) {
  return decision.outcome == Outcome::kFalsified && decision.cause == Cause::kPairwise &&
         decision.first_observation >= 0 && problem.declaration.affine.Contains(decision.coordinate);
}

std::string ExplainAffine(const Decision& decision, const Problem& problem, const std::string& observations) {
  return "abstain F: no affine residual of " + VariableName(*problem.model, decision.coordinate) + " agrees with " +
         observations + ": " +
         (decision.threshold > 0
              ? "one of its slopes is " + RoundedDown(decision.margin) + " at least, declaration.lipschitz says " +
                    ToText(decision.threshold) + " at most"
              : "one is " + RoundedDown(decision.margin) + " off what the others allow");
}

std::string ExplainFalsified(const Decision& decision, const Problem& problem) {
  const std::string coordinate = VariableName(*problem.model, decision.coordinate);
  if (const int region = Violation::RegionOf(decision.second_observation);
      decision.cause == Cause::kBound && region >= 0)
    return "abstain F: transition " + std::to_string(decision.first_observation) + " shows a residual of " +
           coordinate + " of at least " + RoundedDown(decision.margin) + " in size, declaration.regions[" +
           std::to_string(region) + "].bound, " + BoxText(problem.declaration.regions, region, *problem.model) +
           ", declares " + ToText(decision.threshold) + " at most";
  if (decision.cause == Cause::kBound)
    return "abstain F: in transition " + std::to_string(decision.first_observation) + " " + coordinate +
           " changes by at least " + RoundedDown(decision.margin) + " a second, " +
           KeyOfRate(problem, decision.coordinate) + " declares " + ToText(decision.threshold) + " at most";
  if (IsOfAffineRow(decision, problem))
    return ExplainAffine(decision, problem,
                         "a few observations, " + std::to_string(decision.first_observation) + " and " +
                             std::to_string(decision.second_observation) + " among them");
  if (decision.first_observation < 0)
    return "abstain F: at step " + std::to_string(decision.step) + " no residual in " + coordinate +
           " agrees with all observations and the declaration";
  return "abstain F: observations " + std::to_string(decision.first_observation) + " and " +
         std::to_string(decision.second_observation) + " differ in " + coordinate + " by " +
         RoundedDown(decision.margin) + ", the declaration allows " + RoundedUp(decision.threshold);
}

// "at step 3"; where a problem bounds the motion between samples, "between steps 3 and 4".
std::string TimeText(const Problem& problem, int step) {
  if (!problem.between) return "at step " + std::to_string(step);
  return "between steps " + std::to_string(step) + " and " + std::to_string(step + 1);
}

bool NamesPart(const Problem& problem, int part) { return problem.body.parts.size() > 1 && part >= 0; }

std::string ExplainLimit(const Decision& decision, const Problem& problem) {
  const auto i = ToSize(decision.coordinate);
  const std::string name = i < problem.limits.size() ? problem.limits[i].name : "limit " + std::to_string(i);
  const std::string where = "abstain S: at step " + std::to_string(decision.step) + " " + name;
  const bool below = decision.margin < decision.threshold;
  const std::string limit = ToText(decision.threshold);
  if (!std::isfinite(decision.margin)) return where + " has no finite bound, its limit is " + limit;
  return where + " may reach " + Beyond(decision.margin, below) +
         (below ? ", below its limit " : ", above its limit ") + limit;
}

std::string ExplainSafety(const Decision& decision, const Problem& problem, std::span<const Obstacle> obstacles) {
  if (decision.cause == Cause::kLimit) return ExplainLimit(decision, problem);
  const double clearance = SubDown(decision.margin, decision.threshold);
  if (decision.outcome == Outcome::kCertified)
    return ExplainCertificate(problem, {decision.closest_step, decision.obstacle, decision.part, clearance}, obstacles);
  const std::string who = NamesPart(problem, decision.part) ? "part " + std::to_string(decision.part) : "the robot";
  return "abstain S: " + TimeText(problem, decision.step) + " " + who + " " +
         MayTouch(obstacles, decision.obstacle, decision.block) + " (by " + RoundedUp(-clearance) + " m)";
}

std::string Sentence(const Decision& decision, const Problem& problem, std::span<const Obstacle> obstacles) {
  const NominalModel& model = *problem.model;
  switch (decision.outcome) {
    case Outcome::kFalsified: return ExplainFalsified(decision, problem);
    case Outcome::kDomain: {
      const std::string where = "abstain D: at step " + std::to_string(decision.step) + " ";
      if (decision.cause == Cause::kDomainExit) return where + ExplainExit(decision.exit, model);
      if (decision.cause == Cause::kNoStop) {
        const bool below = decision.margin < decision.threshold;
        return where + "the plan ends, and " + VariableName(model, decision.coordinate) + " reaches " +
               Beyond(decision.margin, below) + "; standing is up to " + ToText(decision.threshold);
      }
      if (decision.cause == Cause::kBetween)
        return where + VariableName(model, decision.coordinate) + " changes by " + RoundedDown(decision.margin) +
               " at least, and " + KeyOfRate(problem, decision.coordinate) + " allows " +
               RoundedUp(decision.threshold) + " at most: one of the two is wrong";
      return where + "the next " + VariableName(model, decision.coordinate) + " has no finite enclosure";
    }
    case Outcome::kSafety:
    case Outcome::kCertified: return ExplainSafety(decision, problem, obstacles);
    case Outcome::kNone: break;
  }
  return "no decision";
}

// Why there is no finite enclosure; empty if it is not known.
std::string ExplainUnbounded(const Decision& decision, const Certifier& certifier, const Plan& plan, const Tube& tube) {
  const NominalModel& model = *certifier.problem().model;
  const int t = decision.step;
  if (decision.cause != Cause::kNoFiniteEnclosure || t < 0 || t > tube.length() || t >= plan.num_steps) return "";
  if (certifier.problem().declaration.affine.Contains(decision.coordinate))
    if (const std::string why = certifier.Unexcited(); !why.empty()) return ": " + why;
  std::vector<Interval> box;
  for (int k = 0; k < model.num_states(); ++k) box.push_back(tube.hull(t, k));
  for (const double u : plan.input(t)) box.emplace_back(u);
  const std::optional<Unbounded> found = FindUnbounded(model, box, decision.coordinate);
  if (!found) return "";
  std::string states;
  for (const int k : found->states) states += (states.empty() ? "" : ", ") + VariableName(model, k);
  const std::string place = model.text() == nullptr ? " of its equations"
                                                    : " at line " + std::to_string(found->line) + ", column " +
                                                          std::to_string(found->column) + " of the model";
  return ": " + found->operation + place + " has a kink or a pole there; its argument" +
         (states.empty() ? "" : ", a function of " + states + ",") + " may be anywhere in [" +
         RoundedDown(found->argument.lower) + ", " + RoundedUp(found->argument.upper) + "]";
}

}  // namespace

Interval ResidualOver(const Tube& tube, int t, int k) {
  const ResidualBounds& bounds = tube.step(t).envelope;
  const std::span<const double> half_width = tube.half_width(t);
  double spread = 0;
  for (std::size_t l = 0; l < half_width.size() && bounds.has_slope; ++l)
    spread = AddUp(spread, MulUp(std::abs(bounds.slope[ToSize(k)][l]), half_width[l]));
  return Interval(bounds.lower[ToSize(k)], bounds.upper[ToSize(k)]) + Interval(-spread, spread);
}

std::string ExplainCertificate(const Problem& problem, const ClosestApproach& closest,
                               std::span<const Obstacle> obstacles) {
  const double error = problem.timing.error;
  const std::string steps =
      error > 0 ? "; steps up to " + RoundedDown(error) + " s off their times" : "; steps on time";
  const std::string limits = (problem.limits.empty() ? "" : "; within its limits at the sample instants") + steps;
  if (closest.obstacle < 0) return "certified: no obstacle is there" + limits;
  const std::string who = NamesPart(problem, closest.part) ? "part " + std::to_string(closest.part) + " " : "";
  return std::string(problem.between ? "certified: the robot stays clear at all times"
                                     : "certified at its sample instants only: the robot stays clear") +
         (problem.declaration.IsDisturbed() ? " under the declared disturbance" : "") + ", closest " +
         TimeText(problem, closest.step) + ", " + who + RoundedDown(closest.clearance) + " m from " +
         NameOf(obstacles, closest.obstacle) + limits;
}

std::string CertifiedInPieces(int pieces) { return "; X0 in " + std::to_string(pieces) + " pieces"; }
std::string AlsoInPieces(int trials) { return "; so after " + std::to_string(trials) + " trials with X0 in pieces"; }

std::string ObstacleNamedIn(std::string_view sentence) {
  for (const std::string_view before : {" may touch ", " may leave ", " m from "})
    if (const std::size_t at = sentence.find(before); at != std::string_view::npos) {
      std::string_view name = sentence.substr(at + before.size());
      const std::size_t of = name.substr(0, name.find(" (by ")).find(" of ");
      if (before != " m from " && of != std::string_view::npos) name.remove_prefix(of + 4);  // "cell (0, 1) of map"
      name = name.substr(0, name.find_first_of(" ,;"));
      if (!WhyNoName(name).empty() || name == "obstacle") return {};
      return std::string(before == " may leave " ? kOutside : "").append(name);
    }
  return {};
}

const char* HoldsName(const Problem& problem) { return problem.between ? "all_times" : "samples"; }

std::string Explain(const Decision& decision, const Problem& problem, std::span<const Obstacle> obstacles) {
  return Sentence(decision, problem, obstacles) + (decision.capped ? kCapped : "");
}

std::string Explain(const Decision& decision, const Certifier& certifier, std::span<const Obstacle> obstacles,
                    const Plan& plan, const Tube& tube) {
  const Problem& problem = certifier.problem();
  if (certifier.violation() && IsOfAffineRow(decision, problem)) {
    std::string observations;
    for (const int id : certifier.Contradicting())
      observations += (observations.empty() ? "observations " : ", ") + std::to_string(id);
    return ExplainAffine(decision, problem, observations);
  }
  return Sentence(decision, problem, obstacles) + ExplainUnbounded(decision, certifier, plan, tube) +
         (decision.capped ? kCapped : "");
}

}  // namespace forereach
