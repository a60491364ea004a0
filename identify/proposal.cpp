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
double Rounded(double x) { return std::strtod(RoundedUp(x, ProposedDeclaration::kDigits).c_str(), nullptr); }

Observations Thinned(const Observations& observations, int most) {
  const std::vector<int> rows = EvenRows(observations.size(), most);
  return {observations.z(rows, Eigen::all), observations.lower(rows, Eigen::all), observations.upper(rows, Eigen::all)};
}

// The columns' scales, -1 for those that are not free.
Eigen::RowVectorXd FreeScales(const Eigen::RowVectorXd& scales, const std::vector<int>& columns) {
  Eigen::RowVectorXd free = Eigen::RowVectorXd::Constant(scales.size(), -1);
  for (const int l : columns)
    if (scales[l] > 0) free[l] = scales[l];
  return free;
}

// The smallest row for several disturbances from the declared one over the one that takes all scatter to the last.
std::vector<ProposedRow::Trade> TradesOf(Declaration declaration, const Observations& observations, int k,
                                         const Eigen::RowVectorXd& scales, double scatter, double last) {
  const double declared = declaration.disturbance[k];
  std::vector<ProposedRow::Trade> trades;
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0})
    trades.push_back({.disturbance = declared + share * scatter, .slopes = {}});
  trades.push_back({.disturbance = last, .slopes = {}});
  for (ProposedRow::Trade& trade : trades) {
    declaration.disturbance[k] = trade.disturbance;
    if (const SmallestRow row = FindSmallestRow(declaration, observations, k, scales); !row.unexplained)
      trade.slopes = row.slopes;
  }
  return trades;
}

// Raises w^_k to what near places show.
void EstimateDisturbance(Declaration& proposed, const Observations& observations, int k,
                         const Eigen::RowVectorXd& scales, double factor, ProposedRow& row) {
  row.scatter = FindScatter(proposed, observations, k, scales);
  if (!(row.scatter > 0)) return;
  if (proposed.disturbance.size() == 0) proposed.disturbance = Eigen::VectorXd::Zero(observations.num_states());
  const double disturbance = Rounded(factor * (proposed.disturbance[k] + row.scatter));
  row.trades = TradesOf(proposed, observations, k, scales, row.scatter, disturbance);
  proposed.disturbance[k] = disturbance;
}

}  // namespace

Observations ObserveForProposal(const Problem& problem, const Transitions& transitions) {
  Declaration declaration = problem.declaration;
  declaration.lipschitz.setZero();
  return Observe(*problem.model, declaration, transitions);
}

ProposedDeclaration Propose(const Declaration& declaration, const Observations& observations,
                            const ProposalOptions& options) {
  const int n = observations.num_states();
  const Eigen::RowVectorXd scales = ScalesOf(observations);
  ProposedDeclaration proposal{declaration, std::vector<ProposedRow>(ToSize(n)), {}};
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
    const Eigen::RowVectorXd free = FreeScales(scales, options.columns[ToSize(k)]);
    if (options.estimate_disturbance) EstimateDisturbance(proposed, observations, k, free, options.factor, row);
    row.smallest = FindSmallestRow(proposed, observations, k, free);
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
