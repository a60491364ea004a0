#include "experiments/cell.h"

#include <algorithm>
#include <utility>

#include "certifier/numerics/text.h"
#include "certifier/residual/consistency.h"
#include "certifier/residual/observations.h"
#include "experiments/chunks/support.h"
#include "experiments/evaluate.h"

namespace forereach::experiments {
namespace {

char LetterOf(Outcome outcome) {
  switch (outcome) {
    case Outcome::kCertified: return 'C';
    case Outcome::kDomain: return 'D';
    case Outcome::kFalsified: return 'F';
    default: return 'S';
  }
}

void Count(const Answer& answer, const Scenario& scenario, const Rollouts& rollouts, Tally& tally) {
  const bool safe = rollouts.StayClearOf(scenario.obstacle);
  ++tally.plans;
  tally.safe += safe;
  tally.answers += LetterOf(answer.outcome);
  tally.areas.push_back(answer.IsComplete() ? ProjectedArea(answer.slices.back()) : -1);
  if (answer.outcome == Outcome::kFalsified) {
    ++tally.falsified;
    return;
  }
  const Membership cover = Cover(answer, rollouts);
  const bool covered = cover == Membership::kInside;
  tally.undecided += cover == Membership::kUndecided;
  (answer.IsComplete() ? tally.covered : tally.prefix_covered) += covered;
  const auto step = static_cast<std::size_t>(std::max(answer.step, 0));
  switch (answer.outcome) {
    case Outcome::kCertified:
      ++tally.certified;
      tally.certified_safe += safe;
      return;
    case Outcome::kDomain:
      ++tally.domain;
      ++tally.domain_steps[step];
      return;
    default: ++tally.safety; ++tally.safety_steps[step];
  }
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

CellResult RunCell(const Cell& cell, const Effort& effort) {
  const System& system = *cell.system;
  const Transitions data = MakeData(system, cell.layout, cell.seed, cell.observations, cell.noise);
  const Declaration declaration{cell.declared.matrix,
                                Eigen::VectorXd::Constant(system.num_states(), NoiseBound(cell.noise))};
  const auto residual =
      cell.method.make({*system.model, system.domain, declaration, data, static_cast<std::uint64_t>(cell.seed)});
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
        answer.outcome = Outcome::kFalsified;
      else
        evaluator.Certify(scenario, answer);
      Count(answer, scenario, rollouts, tally);
      if (system.support_scale.size() > 0) tally.distances.push_back(DistanceToData(system, scenario, data));
    }
  }
  return result;
}

}  // namespace forereach::experiments
