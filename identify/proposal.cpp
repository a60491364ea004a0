#include "identify/proposal.h"

#include <algorithm>
#include <cstdlib>

#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "identify/slopes.h"

namespace forereach {
namespace {

constexpr int kMostForEstimators = 1000;

// A double that is at least x and prints with few digits.
double Rounded(double x) { return std::strtod(RoundedUp(x, Proposal::kDigits).c_str(), nullptr); }

Observations Thinned(const Observations& observations, int most) {
  const int count = std::min(observations.size(), most);
  std::vector<int> rows;
  for (int i = 0; i < count; ++i)
    rows.push_back(static_cast<int>(static_cast<std::int64_t>(i) * observations.size() / count));
  return {observations.z(rows, Eigen::all), observations.lower(rows, Eigen::all), observations.upper(rows, Eigen::all)};
}

// The columns' scales, -1 for those that are not free.
Eigen::RowVectorXd FreeScales(const Eigen::RowVectorXd& scales, const std::vector<int>& columns) {
  Eigen::RowVectorXd free = Eigen::RowVectorXd::Constant(scales.size(), -1);
  for (const int l : columns)
    if (scales[l] > 0) free[l] = scales[l];
  return free;
}

}  // namespace

Observations ObserveForProposal(const Problem& problem, const Transitions& transitions) {
  Declaration declaration = problem.declaration;
  declaration.lipschitz.setZero();
  return Observe(*problem.model, declaration, transitions);
}

Proposal Propose(const Declaration& declaration, const Observations& observations, const ProposalOptions& options) {
  const int n = observations.num_states();
  const Eigen::RowVectorXd scales = ScalesOf(observations);
  Proposal proposal{declaration, std::vector<ProposedRow>(ToSize(n)), {}};
  for (int l = 0; l < scales.size(); ++l)
    if (!(scales[l] > 0)) proposal.constant.push_back(l);
  Declaration& proposed = proposal.declaration;
  proposed.lipschitz = Eigen::MatrixXd::Zero(n, scales.size());
  for (int k = 0; k < n; ++k) {
    ProposedRow& row = proposal.rows[ToSize(k)];
    row.noise = FindNoiseFloor(observations, k, options.columns[ToSize(k)]);
    if (const double shown = std::max(row.noise.repeated, 3 * row.noise.deviation);
        options.estimate_noise && shown > proposed.noise_bound[k])
      proposed.noise_bound[k] = Rounded(shown);
    row.smallest = FindSmallestRow(proposed, observations, k, FreeScales(scales, options.columns[ToSize(k)]));
    if (row.smallest.unexplained) throw Unexplained(k, *row.smallest.unexplained);
    if (options.advance) options.advance();
  }
  Declaration smallest = proposed;
  for (int k = 0; k < n; ++k) {
    smallest.lipschitz.row(k) = proposal.rows[ToSize(k)].smallest.slopes;
    for (Eigen::Index l = 0; l < scales.size(); ++l)
      proposed.lipschitz(k, l) = Rounded(options.factor * smallest.lipschitz(k, l));
  }
  const Observations some = Thinned(observations, kMostForEstimators);
  const std::vector<double> strongin = EstimateSlopes(SlopeEstimator::kStrongin, smallest, some, 1),
                            knuth_chou = EstimateSlopes(SlopeEstimator::kKnuthChou, smallest, some, 1);
  for (int k = 0; k < n; ++k) {
    ProposedRow& row = proposal.rows[ToSize(k)];
    row.strongin = strongin[ToSize(k)];
    row.knuth_chou = knuth_chou[ToSize(k)];
    row.least = Eigen::RowVectorXd::Zero(scales.size());
    for (int l = 0; l < scales.size(); ++l)
      if (proposed.lipschitz(k, l) > 0) row.least[l] = FindSmallestEntry(proposed, observations, k, l).slopes[l];
    if (options.advance) options.advance();
  }
  return proposal;
}

}  // namespace forereach
