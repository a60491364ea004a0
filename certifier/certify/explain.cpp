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

std::string ExplainSafety(const Decision& decision) {
  const std::string obstacle = "obstacle " + std::to_string(decision.obstacle);
  const double clearance = SubDown(decision.margin, decision.threshold);
  if (decision.outcome == Outcome::kSafety)
    return "abstain S: at step " + std::to_string(decision.step) + " the tube may touch " + obstacle + " (by " +
           RoundedUp(-clearance) + " m)";
  return ExplainCertificate(decision.closest_step, decision.obstacle, clearance);
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
    case Outcome::kCertified: return ExplainSafety(decision);
    case Outcome::kNone: break;
  }
  return "no decision";
}

}  // namespace

std::string ExplainCertificate(int closest_step, int obstacle, double clearance) {
  if (obstacle < 0) return "certified: no obstacles";
  return "certified: every slice stays clear, closest at step " + std::to_string(closest_step) + ", " +
         RoundedDown(clearance) + " m from obstacle " + std::to_string(obstacle);
}

std::string Explain(const Decision& decision, const Problem& problem) {
  return Sentence(decision, problem) + (decision.capped ? kCapped : "");
}

}  // namespace forereach
