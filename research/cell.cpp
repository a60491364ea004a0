#include "research/cell.h"

#include <algorithm>
#include <stdexcept>

#include "forereach/numerics/text.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/observations.h"
#include "research/chunks/support.h"
#include "research/evaluate.h"
#include "research/methods/cp_sls.h"

namespace forereach::research {
namespace {

char LetterOf(Outcome outcome) {
  switch (outcome) {
    case Outcome::kCertified: return 'C';
    case Outcome::kDomain: return 'D';
    case Outcome::kFalsified: return 'F';
    case Outcome::kSafety: return 'S';
    case Outcome::kNone: break;
  }
  throw std::logic_error("a plan was not decided");
}

// The sum over the steps whose query is known, the one that D ended the tube at included.
CpSlsBudget CountBudget(const CpSls& method, const Answer& answer, const Scenario& scenario, PlanBudgets& budgets) {
  const auto inputs = static_cast<std::size_t>(scenario.controls.rows());
  const int known = std::min(answer.tube.length() + 1, static_cast<int>(scenario.controls.cols()));
  CpSlsBudget sum;
  double least_mass = kInfinity;
  for (int t = 0; t < known; ++t) {
    const QuerySet query{answer.tube.slice(t), {scenario.controls.col(t).data(), inputs}, answer.tube.half_width(t)};
    const CpSlsBudget budget = method.Budget(query);
    sum += budget;
    least_mass = std::min(least_mass, budget.mass);
  }
  budgets.drift.push_back(sum.starved ? -1 : sum.drift);
  budgets.tube.push_back(sum.starved ? -1 : sum.tube);
  budgets.total.push_back(sum.starved ? -1 : sum.total());
  budgets.least_mass.push_back(least_mass);
  budgets.at_cap.push_back(sum.at_cap / known);
  budgets.complete.push_back(answer.IsComplete());
  return sum;
}

PlanOutcome Count(const Answer& answer, const Scenario& scenario, const Rollouts& rollouts, bool is_vacuous,
                  Tally& tally) {
  PlanOutcome seen{.group = tally.group, .plan = tally.plans};
  const bool safe = rollouts.StayClearOf(scenario.obstacle);
  ++tally.plans;
  tally.safe += safe;
  tally.answers +=
      is_vacuous && answer.decision.outcome == Outcome::kCertified ? 'V' : LetterOf(answer.decision.outcome);
  tally.areas.push_back(answer.IsComplete() ? ProjectedArea(answer.tube.slice(answer.tube.length())) : -1);
  seen.answer = tally.answers.back();
  seen.safe = safe;
  seen.complete = answer.IsComplete();
  seen.area = tally.areas.back();
  if (answer.decision.outcome == Outcome::kFalsified) {
    ++tally.falsified;
    seen.cover = Membership::kUndecided;
    return seen;
  }
  const Membership cover = Cover(answer, rollouts);
  const bool covered = cover == Membership::kInside;
  seen.cover = cover;
  tally.undecided += cover == Membership::kUndecided;
  (answer.IsComplete() ? tally.covered : tally.prefix_covered) += covered;
  const auto step = static_cast<std::size_t>(std::max(answer.decision.step, 0));
  switch (answer.decision.outcome) {
    case Outcome::kCertified:
      if (is_vacuous) {
        ++tally.vacuous;
        break;
      }
      ++tally.certified;
      tally.certified_safe += safe;
      break;
    case Outcome::kDomain:
      ++tally.domain;
      ++tally.domain_steps[step];
      seen.step = answer.decision.step;
      break;
    case Outcome::kSafety:
      ++tally.safety;
      ++tally.safety_steps[step];
      seen.step = answer.decision.step;
      break;
    case Outcome::kFalsified:  // counted above
    case Outcome::kNone: break;
  }
  return seen;
}

}  // namespace

std::string Cell::key() const {
  std::string name = system->name + "-" + method.name + "-" + declared.name + "-N" + std::to_string(observations) +
                     "-s" + ToText(noise) + "-order" + std::to_string(zonotope_order) + "-" + NameOf(layout) + "-seed" +
                     std::to_string(seed);
  std::ranges::replace_if(
      name, [](char c) { return !(std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '-' || c == '_'); },
      '_');
  return name;
}

Cell PaperCell(const System& system, int observations, double noise, int seed) {
  return {&system, Methods().front(), {"deployed", system.deployed}, observations, noise, seed, 5, Layout::kCorridor};
}

CellResult RunCell(const Cell& cell, const Effort& effort, const std::function<void(const PlanOutcome&)>& see) {
  const System& system = *cell.system;
  const Transitions data = MakeData(system, cell.layout, cell.seed, cell.observations, cell.noise, cell.cut);
  const Declaration declaration{cell.declared.matrix,
                                Eigen::VectorXd::Constant(system.num_states(), NoiseBound(cell.noise, cell.cut))};
  const auto residual =
      cell.method.make({*system.model, system.domain, declaration, data, static_cast<std::uint64_t>(cell.seed)});
  const auto* const budgeted = dynamic_cast<const CpSls*>(residual.get());
  const bool falsified = cell.method.name == Methods().front().name &&
                         FindViolation(declaration, Observe(*system.model, data)).has_value();
  const Evaluator evaluator(system, *residual, cell.zonotope_order);
  const auto steps = static_cast<std::size_t>(system.horizon) + 1;
  CellResult result;
  Answer answer;
  for (std::size_t g = 0; g < result.size(); ++g) {
    Tally& tally = result[g];
    tally.group = NameOf(kGroups[g]);
    tally.domain_steps.assign(steps, 0);
    tally.safety_steps.assign(steps, 0);
    for (int i = 0; i < std::min(effort.scenarios, system.scenarios); ++i) {
      const Scenario scenario = MakeScenario(system, kGroups[g], cell.seed, i);
      const Rollouts rollouts(system, scenario, std::min(effort.rollouts, system.rollouts));
      if (falsified)
        answer.decision.outcome = Outcome::kFalsified;
      else
        evaluator.Certify(scenario, answer);
      const bool is_vacuous = budgeted && CountBudget(*budgeted, answer, scenario, tally.budgets).IsVacuous();
      const PlanOutcome seen = Count(answer, scenario, rollouts, is_vacuous, tally);
      if (see) see(seen);
      if (system.support_scale.size() > 0) tally.distances.push_back(DistanceToData(system, scenario, data));
    }
  }
  return result;
}

}  // namespace forereach::research
