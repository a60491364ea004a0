#include "research/experiment.h"

#include <stdexcept>

namespace forereach::research {
namespace {

std::optional<double> Ratio(int count, int of) {
  if (of == 0) return std::nullopt;
  return static_cast<double>(count) / of;
}

}  // namespace

std::vector<int> Scope::SizesOf(const System& system) const {
  const std::vector<int>& all = system.sample_sizes;
  if (!quick || all.size() == 1) return all;
  return {all.front(), all.back()};
}

Results::Results(Scope of, const std::vector<Cell>& cells, const std::vector<CellResult>& results) : scope(of) {
  for (std::size_t i = 0; i < cells.size(); ++i) by_key_.emplace(cells[i].key(), results[i]);
}

const CellResult& Results::Of(const Cell& cell) const {
  const auto found = by_key_.find(cell.key());
  if (found == by_key_.end()) throw std::invalid_argument("results: no cell " + cell.key());
  return found->second;
}

std::span<const Experiment> Experiments() {
  static const std::vector<Experiment> all{
      MainResults(),           RecallByN(),          DirectCoverage(),    Comparison(),           Readings(),
      NoisyComparison(),       CertificateBudget(),  ActionChunks(),      DomainExits(),          FirstAbstentions(),
      TubeGeometry(),          BoxAgainstZonotope(), ScalarEnvelope(),    NoiseSweep(),           NominalDegradation(),
      IncorrectDeclarations(), EstimatedSlopes(),    AdversarialFamily(), KeptDeclaration(),      AssumptionFamilies(),
      ParameterBoxes(),        NormRatios(),         InformationLimits(), CertifiedDeclarations()};
  return all;
}

std::optional<double> Recall(const Tally& tally) { return Ratio(tally.certified_safe, tally.safe); }
std::optional<double> Coverage(const Tally& tally) { return Ratio(tally.covered, tally.complete()); }
std::optional<double> CompleteRate(const Tally& tally) { return Ratio(tally.complete(), tally.plans); }
std::optional<double> JointRate(const Tally& tally) { return Ratio(tally.covered, tally.plans); }
std::optional<double> CertificateRate(const Tally& tally) { return Ratio(tally.certified, tally.plans); }
std::optional<double> FalseSafeRate(const Tally& tally) { return Ratio(tally.false_certificates(), tally.certified); }
std::optional<double> DomainRate(const Tally& tally) { return Ratio(tally.domain, tally.plans); }
std::optional<double> SafetyRate(const Tally& tally) { return Ratio(tally.safety, tally.plans); }
std::optional<double> FalsifiedRate(const Tally& tally) { return Ratio(tally.falsified, tally.plans); }

Estimate OverSeeds(const Scope& scope, const std::function<std::optional<double>(int seed)>& value) {
  std::vector<std::optional<double>> values;
  for (int seed = 0; seed < scope.seeds; ++seed) values.push_back(value(seed));
  return EstimateOf(values);
}

Estimate Results::Mean(Cell cell, Group group, Statistic statistic) const {
  return OverSeeds(scope, [&](int seed) { return cell.seed = seed, statistic(Of(cell, group)); });
}

int Results::FalseCertificates(const Cell& cell) const {
  int count = 0;
  for (const Group group : kGroups) count += FalseCertificates(cell, group);
  return count;
}

int Results::FalseCertificates(Cell cell, Group group) const {
  int count = 0;
  for (cell.seed = 0; cell.seed < scope.seeds; ++cell.seed) count += Of(cell, group).false_certificates();
  return count;
}

void AddSeeds(const Scope& scope, Cell cell, std::vector<Cell>& cells) {
  for (cell.seed = 0; cell.seed < scope.seeds; ++cell.seed) cells.push_back(cell);
}

}  // namespace forereach::research
