#include "certifier/certify/explain.h"

#include "certifier/numerics/size.h"
#include "certifier/numerics/text.h"

namespace forereach {
namespace {

std::string VariableName(const NominalModel& model, int index) {
  if (index < 0 || index >= model.num_variables()) return "coordinate " + std::to_string(index);
  return model.variable_names()[ToSize(index)];
}

std::string ExplainExit(const DomainExit& exit, const NominalModel& model) {
  using Kind = DomainExit::Kind;
  // What is reached, away from the bound; the bound itself, towards it.
  const bool below = exit.kind == Kind::kLower;
  const std::string value = below ? RoundedDown(exit.value) : RoundedUp(exit.value);
  const std::string bound = below ? RoundedUp(exit.bound) : RoundedDown(exit.bound);
  switch (exit.kind) {
    case Kind::kLower: return VariableName(model, exit.index) + " reaches " + value + ", below its bound " + bound;
    case Kind::kUpper: return VariableName(model, exit.index) + " reaches " + value + ", above its bound " + bound;
    case Kind::kInequality:
      return "inequality " + std::to_string(exit.index) + " reaches " + value + ", above its bound " + bound;
    case Kind::kBall:
      return "ball " + std::to_string(exit.index) + ": distance reaches " + value + ", above its radius " + bound;
    case Kind::kNone: break;
  }
  return "no constraint of the domain is violated";
}

std::string ExplainFalsified(const Decision& decision, const NominalModel& model) {
  const std::string coordinate = VariableName(model, decision.coordinate);
  if (decision.first_observation < 0)
    return "abstain F: at step " + std::to_string(decision.step) + " no residual in " + coordinate +
           " agrees with all observations and the declaration";
  return "abstain F: observations " + std::to_string(decision.first_observation) + " and " +
         std::to_string(decision.second_observation) + " differ in " + coordinate + " by " +
         RoundedDown(decision.margin) + ", the declaration allows " + RoundedUp(decision.threshold);
}

// A sample, or the time from it to the next.
std::string TimeText(const Problem& problem, int step) {
  if (!problem.between) return "at step " + std::to_string(step);
  return "between steps " + std::to_string(step) + " and " + std::to_string(step + 1);
}

bool NamesPart(const Problem& problem, int part) { return problem.body.parts.size() > 1 && part >= 0; }

std::string ExplainSafety(const Decision& decision, const Problem& problem) {
  const double clearance = SubDown(decision.margin, decision.threshold);
  if (decision.outcome == Outcome::kCertified)
    return ExplainCertificate(problem, {decision.closest_step, decision.obstacle, decision.part, clearance});
  const std::string who = NamesPart(problem, decision.part) ? "part " + std::to_string(decision.part) : "the robot";
  return "abstain S: " + TimeText(problem, decision.step) + " " + who + " may touch obstacle " +
         std::to_string(decision.obstacle) + " (by " + RoundedUp(-clearance) + " m)";
}

std::string Sentence(const Decision& decision, const Problem& problem) {
  const NominalModel& model = *problem.model;
  switch (decision.outcome) {
    case Outcome::kFalsified: return ExplainFalsified(decision, model);
    case Outcome::kDomain: {
      const std::string where = "abstain D: at step " + std::to_string(decision.step) + " ";
      if (decision.cause == Cause::kDomainExit) return where + ExplainExit(decision.exit, model);
      if (decision.cause == Cause::kNoStop) {
        const bool below = decision.margin < decision.threshold;
        return where + "the plan ends, and " + VariableName(model, decision.coordinate) + " reaches " +
               (below ? RoundedDown(decision.margin) : RoundedUp(decision.margin)) + "; standing is up to " +
               (below ? RoundedUp(decision.threshold) : RoundedDown(decision.threshold));
      }
      return where + "the next " + VariableName(model, decision.coordinate) + " has no finite enclosure";
    }
    case Outcome::kSafety:
    case Outcome::kCertified: return ExplainSafety(decision, problem);
    case Outcome::kNone: break;
  }
  return "no decision";
}

}  // namespace

std::string ExplainCertificate(const Problem& problem, const ClosestApproach& closest) {
  if (closest.obstacle < 0) return "certified: no obstacle is there";
  const std::string who = NamesPart(problem, closest.part) ? "part " + std::to_string(closest.part) + " " : "";
  return std::string(problem.between ? "certified: the robot stays clear at all times"
                                     : "certified at its sample instants only: the robot stays clear") +
         (problem.declaration.IsDisturbed() ? " under the declared disturbance" : "") + ", closest " +
         TimeText(problem, closest.step) + ", " + who + RoundedDown(closest.clearance) + " m from obstacle " +
         std::to_string(closest.obstacle);
}

const char* HoldsName(const Problem& problem) { return problem.between ? "all_times" : "samples"; }

std::string Explain(const Decision& decision, const Problem& problem) {
  return Sentence(decision, problem) + (decision.capped ? kCapped : "");
}

}  // namespace forereach
