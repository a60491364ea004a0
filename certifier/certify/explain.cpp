#include "certifier/certify/explain.h"

#include <array>
#include <cstdio>

namespace forereach {
namespace {

std::string Short(double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

std::string VariableName(const NominalModel& model, int index) {
  const int n = model.num_states();
  if (index < 0 || index >= model.num_variables()) return "coordinate " + std::to_string(index);
  return index < n ? model.state_names()[static_cast<std::size_t>(index)]
                   : model.input_names()[static_cast<std::size_t>(index - n)];
}

std::string ExplainExit(const DomainExit& exit, const NominalModel& model) {
  using Kind = DomainExit::Kind;
  const std::string value = Short(exit.value), bound = Short(exit.bound);
  switch (exit.kind) {
    case Kind::kLower:
      return VariableName(model, exit.index) + " reaches " + value + ", below its bound " + bound;
    case Kind::kUpper:
      return VariableName(model, exit.index) + " reaches " + value + ", above its bound " + bound;
    case Kind::kInequality:
      return "inequality " + std::to_string(exit.index) + " reaches " + value + ", above its bound " + bound;
    default:
      return "ball " + std::to_string(exit.index) + ": distance reaches " + value + ", above its radius " + bound;
  }
}

std::string ExplainFalsified(const Decision& decision, const NominalModel& model) {
  const std::string coordinate = VariableName(model, decision.coordinate);
  if (decision.first_observation < 0)
    return "abstain F: at step " + std::to_string(decision.step) + " no residual in " + coordinate +
           " agrees with all observations and the declaration";
  return "abstain F: observations " + std::to_string(decision.first_observation) + " and " +
         std::to_string(decision.second_observation) + " differ in " + coordinate + " by " + Short(decision.margin) +
         ", the declaration allows " + Short(decision.threshold);
}

std::string ExplainSafety(const Decision& decision) {
  const std::string obstacle = "obstacle " + std::to_string(decision.obstacle);
  const double clearance = decision.margin - decision.threshold;
  if (decision.outcome == Outcome::kSafety)
    return "abstain S: at step " + std::to_string(decision.step) + " the tube may touch " + obstacle + " (by " +
           Short(-clearance) + " m)";
  if (decision.obstacle < 0) return "certified: no obstacles";
  return "certified: every slice stays clear, closest at step " + std::to_string(decision.closest_step) + ", " +
         Short(clearance) + " m from " + obstacle;
}

std::string Sentence(const Decision& decision, const Problem& problem) {
  const NominalModel& model = *problem.model;
  switch (decision.outcome) {
    case Outcome::kFalsified:
      return ExplainFalsified(decision, model);
    case Outcome::kDomain: {
      const std::string where = "abstain D: at step " + std::to_string(decision.step) + " ";
      if (decision.cause == Cause::kDomainExit) return where + ExplainExit(decision.exit, model);
      if (decision.cause == Cause::kNoStop)
        return where + "the plan ends, and " + VariableName(model, decision.coordinate) + " reaches " +
               Short(decision.margin) + "; standing is up to " + Short(decision.threshold);
      return where + "the next " + VariableName(model, decision.coordinate) + " has no finite enclosure";
    }
    case Outcome::kSafety:
    case Outcome::kCertified:
      return ExplainSafety(decision);
    case Outcome::kNone:
      break;
  }
  return "no decision";
}

}  // namespace

std::string Explain(const Decision& decision, const Problem& problem) {
  return Sentence(decision, problem) + (decision.capped ? "; a search met max_leaf_visits" : "");
}

}  // namespace forereach
