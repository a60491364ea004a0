#include "research/chunks/support.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "planner_bridge/reference.h"

namespace forereach::research {
namespace {

double AbstentionRate(std::span<const SupportRecord> records) {
  return static_cast<double>(std::ranges::count(records, true, &SupportRecord::abstained)) /
         static_cast<double>(records.size());
}

// Pearson's correlation of two columns.
std::optional<double> Correlation(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd from_mean_a = a.array() - a.mean(), from_mean_b = b.array() - b.mean();
  const double norms = from_mean_a.norm() * from_mean_b.norm();
  if (!(norms > 0)) return std::nullopt;
  return from_mean_a.dot(from_mean_b) / norms;
}

// The ranks of sorted records by distance. Of two values alone, abstentions need none: any two numbers correlate alike.
Eigen::VectorXd Ranks(const std::vector<SupportRecord>& sorted) {
  Eigen::VectorXd ranks(static_cast<Eigen::Index>(sorted.size()));
  for (std::size_t first = 0, last; first < sorted.size(); first = last) {
    for (last = first; last < sorted.size() && sorted[last].distance == sorted[first].distance;) ++last;
    ranks.segment(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(last - first))
        .setConstant(static_cast<double>(first + last - 1) / 2);
  }
  return ranks;
}

}  // namespace

double DistanceToData(const System& system, const Scenario& scenario, const Transitions& data) {
  const Eigen::Index n = system.num_states();
  const Eigen::MatrixXd scale = system.support_scale.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd states = scale * Rollout(*system.model, scenario.center, scenario.controls);
  const Eigen::MatrixXd observed = scale * data.z.leftCols(n).transpose();
  double farthest = 0;
  for (const auto& state : states.colwise())
    farthest = std::max(farthest, (observed.colwise() - state).colwise().squaredNorm().minCoeff());
  return std::sqrt(farthest);
}

SupportStatistic SupportOf(std::vector<SupportRecord> records) {
  std::ranges::stable_sort(records, {}, &SupportRecord::distance);
  Eigen::VectorXd abstained(static_cast<Eigen::Index>(records.size()));
  std::ranges::transform(records, abstained.begin(), [](const SupportRecord& record) { return record.abstained; });
  const std::span<const SupportRecord> all = records;
  const std::size_t quarter = records.size() / 4;
  return {Correlation(Ranks(records), abstained), AbstentionRate(all.first(quarter)),
          AbstentionRate(all.last(quarter))};
}

}  // namespace forereach::research
