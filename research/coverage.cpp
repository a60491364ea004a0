// Coverage without the theorem: every state of a rollout is located in its slice of the tube, whatever the envelopes
// say.
#include <array>
#include <numeric>
#include <string>
#include <vector>

#include "research/evaluate.h"
#include "research/experiment.h"
#include "research/methods/envelope.h"

namespace forereach::research {
namespace {

// A center, all corners, and some in between. With ten seeds over 20,000 rollouts of each system.
constexpr int kPlans = 9, kRollouts = 80, kQuickPlans = 2;
constexpr double kNarrowed[] = {0.5, 0.2, 0.1};

struct Count {
  int tubes = 0;
  std::array<int, std::size(kGroups)> complete{}, directly{};  // By group: complete tubes, and those with every rollout
  int by_envelopes = 0;                                        // Complete tubes with every rollout, as everywhere else
  int left = 0, undecided_tubes = 0;  // Tubes, complete or not, that a rollout provably leaves; that one may leave
  int rollouts = 0, states = 0, outside = 0, undecided = 0;  // Rollouts: outside, undecided
};

void Add(const Answer& answer, const Rollouts& rollouts, Group group, Count& count) {
  Membership all = Membership::kInside;
  for (int i = 0; i < rollouts.count(); ++i) {
    const Membership at = LocateRollout(answer, rollouts, i);
    ++count.rollouts;
    count.states += answer.tube.length() + 1;
    count.outside += at == Membership::kOutside;
    count.undecided += at == Membership::kUndecided;
    if (at == Membership::kOutside || (at == Membership::kUndecided && all == Membership::kInside)) all = at;
  }
  ++count.tubes;
  count.left += all == Membership::kOutside;
  if (!answer.IsComplete()) return;
  ++count.complete[static_cast<std::size_t>(group)];
  count.directly[static_cast<std::size_t>(group)] += all == Membership::kInside;
  count.by_envelopes += Cover(answer, rollouts) == Membership::kInside;
}

// With the envelope `part` times as wide about its middle.
Count CountAll(const Scope& scope, const System& system, double part) {
  Count count;
  Answer answer;
  for (int seed = 0; seed < scope.seeds; ++seed) {
    const Transitions data = MakeData(system, Layout::kCorridor, seed, system.sample_sizes.back(), 0);
    const Declaration declaration{system.deployed, Eigen::VectorXd::Zero(system.num_states())};
    const auto envelope =
        MakeScaledForeReach({*system.model, system.domain, declaration, data, static_cast<std::uint64_t>(seed)}, part);
    const Evaluator evaluator(system, *envelope, 5);
    for (const Group group : kGroups)
      for (int i = 0; i < (scope.quick ? kQuickPlans : kPlans); ++i) {
        const Scenario scenario = MakeScenario(system, group, seed, i);
        evaluator.Certify(scenario, answer);
        Add(answer, Rollouts(system, scenario, kRollouts), group, count);
      }
  }
  return count;
}

std::vector<Table> Tables(const Results& results) {
  Table table{
      "Coverage, directly",
      "Everywhere else coverage is decided by envelopes first: a rollout that starts in X0 and whose residuals lie in "
      "the recorded envelopes lies in the tube, by the theorem; only where they do not is each of its states located "
      "in its slice. Here each state of each rollout is located, and neither the theorem nor an envelope is used. A "
      "state is outside if a direction separates it from the slice, inside if coefficients of the generators lead to "
      "it up to 1e-9 of the slice's half-widths, else undecided. Noiseless, the largest N, groups A to C, the rollouts "
      "of a plan from the center of X0, all its corners and points between. The last rows show that the test can fail: "
      "the same plans and rollouts, the envelope narrowed about its middle.",
      {}};
  for (const System* system : Systems()) {
    const auto row = [&](const std::string& what, double value) { table.Add(system->name + ": " + what, value, 0); };
    const Count count = CountAll(results.scope, *system, 1);
    row("rollouts", count.rollouts);
    row("states located", count.states);
    row("rollouts that leave the tube", count.outside);
    row("rollouts undecided", count.undecided);
    row("tubes, complete or ended by D", count.tubes);
    row("of these complete", std::reduce(count.complete.begin(), count.complete.end()));
    row("complete tubes that contain every rollout, by envelopes first", count.by_envelopes);
    row("the same, directly", std::reduce(count.directly.begin(), count.directly.end()));
    for (const Group group : {Group::kB, Group::kC}) {
      const double complete = count.complete[static_cast<std::size_t>(group)];
      table.Add(system->name + ", " + NameOf(group) + ": coverage, directly",
                {Mark::kOurs, PaperOrNone(system->name + "." + NameOf(group) + ".coverage")},
                complete > 0 ? Estimate(count.directly[static_cast<std::size_t>(group)] / complete) : Estimate(), 3);
    }
    for (const double part : kNarrowed) {
      const Count narrowed = CountAll(results.scope, *system, part);
      row("envelope at " + std::to_string(static_cast<int>(100 * part + 0.5)) + " %: tubes that a rollout leaves, of " +
              std::to_string(narrowed.tubes),
          narrowed.left);
    }
  }
  return {table};
}

}  // namespace

Experiment DirectCoverage() {
  return {"coverage", "coverage by locating every state of over 20,000 rollouts", {}, Tables};
}

}  // namespace forereach::research
