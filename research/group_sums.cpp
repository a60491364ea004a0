#include "research/group_sums.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "research/evaluate.h"

namespace forereach::research {
namespace {

using Clock = std::chrono::steady_clock;

double MicrosecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
}

void CountInto(const CellResult& result, GroupSums& sums) {
  for (std::size_t g = 0; g < result.size(); ++g) {
    const Tally& tally = result[g];
    sums.plans[g] += tally.plans;
    sums.safe[g] += tally.safe;
    sums.certified[g] += tally.certified_safe;
    sums.falsified[g] += tally.falsified;
    sums.false_certificates += tally.false_certificates();
    sums.outside += tally.complete() - tally.covered;
    for (const double area : tally.areas)
      if (area >= 0) ++sums.complete[g], sums.side[g] += std::sqrt(area) / 2;
  }
}

// The median time of a call, over the plans of C.
double CallTime(const System& system, const ResidualEnclosure& residual, int seed, int plans) {
  const Evaluator evaluator(system, residual, 5);
  std::vector<double> times;
  Answer answer;
  for (int i = 0; i < plans; ++i) {
    const Scenario scenario = MakeScenario(system, Group::kC, seed, i);
    const auto begin = Clock::now();
    evaluator.Certify(scenario, answer);
    times.push_back(MicrosecondsSince(begin));
  }
  std::ranges::nth_element(times, times.begin() + std::ssize(times) / 2);
  return times[times.size() / 2];
}

}  // namespace

std::string GroupSums::Recall(std::size_t group) const {
  return safe[group] == 0 ? "none" : fmt::format("{:.3f}", static_cast<double>(certified[group]) / safe[group]);
}

std::string GroupSums::HalfWidth(std::size_t group) const {
  return complete[group] == 0 ? "none" : fmt::format("{:.3f}", side[group] / complete[group]);
}

GroupSums SumOfSeeds(const System& system, const Method& method, const Eigen::MatrixXd& lipschitz, int observations,
                     double noise, int seeds, const Effort& effort) {
  GroupSums sums;
  for (int seed = 0; seed < seeds; ++seed) {
    Cell cell{&system, method, {"certified", lipschitz}, observations, noise, seed};
    CountInto(RunCell(cell, effort), sums);
    const Transitions data = MakeData(system, cell.layout, seed, observations, noise);
    const Declaration declaration{lipschitz, Eigen::VectorXd::Constant(system.num_states(), NoiseBound(noise))};
    const auto begin = Clock::now();
    const auto residual = method.make({*system.model, system.domain, declaration, data, 0});
    sums.build_us += MicrosecondsSince(begin) / seeds;
    sums.call_us += CallTime(system, *residual, seed, effort.scenarios) / seeds;
  }
  return sums;
}

}  // namespace forereach::research
