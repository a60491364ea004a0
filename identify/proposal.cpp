#include "identify/proposal.h"

#include <algorithm>
#include <cstdlib>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "identify/slopes.h"

namespace forereach {
namespace {

// The estimators compare each with each.
constexpr int kMostForEstimators = 1000;

Observations Thinned(const Observations& observations, int most) {
  const std::vector<int> rows = EvenRows(observations.size(), most);
  return {observations.z(rows, Eigen::all), observations.lower(rows, Eigen::all), observations.upper(rows, Eigen::all)};
}

// The declaration with this error of row k, as its noise: pairs know sigma_k + w^_k alone.
Declaration WithError(Declaration declaration, int k, double error) {
  declaration.noise_bound[k] = error;
  if (declaration.disturbance.size() > 0) declaration.disturbance[k] = 0;
  return declaration;
}

std::vector<ProposedRow::Trade> TradesOf(const Declaration& declaration, const Observations& observations, int k,
                                         const Eigen::RowVectorXd& scales, const ProposedRow& row) {
  std::vector<ProposedRow::Trade> trades;
  for (const double share : ProposedRow::kShares) trades.push_back({.error = share * row.knee, .slopes = {}});
  trades.push_back({.error = row.declared, .slopes = {}});
  for (ProposedRow::Trade& trade : trades)
    if (const SmallestRow found = FindSmallestRow(WithError(declaration, k, trade.error), observations, k, scales);
        !found.unexplained)
      trade.slopes = found.slopes;
  return trades;
}

// Finds what near places show, and raises w^_k to that if it is asked for.
void ExamineError(Declaration& proposed, const Observations& observations, int k, const Eigen::RowVectorXd& scales,
                  const ProposalOptions& options, ProposedRow& row) {
  row.knee = FindScatter(WithError(proposed, k, 0), observations, k, scales);
  row.declared = row.proposed = proposed.ObservationError(k);
  row.scatter = std::max(0.0, SubUp(row.knee, row.declared));
  if (options.find_trades && row.knee > 0) row.trades = TradesOf(proposed, observations, k, scales, row);
  if (!options.estimate_disturbance || !(row.scatter > 0)) return;
  if (proposed.disturbance.size() == 0) proposed.disturbance = Eigen::VectorXd::Zero(observations.num_states());
  proposed.disturbance[k] = RoundedToPrint(options.factor * (proposed.disturbance[k] + row.scatter));
  row.proposed = proposed.ObservationError(k);
}

}  // namespace

double RoundedToPrint(double x) { return std::strtod(RoundedUp(x, ProposedDeclaration::kDigits).c_str(), nullptr); }

Eigen::RowVectorXd FreeScales(const Eigen::RowVectorXd& scales, const std::vector<int>& columns) {
  Eigen::RowVectorXd free = Eigen::RowVectorXd::Constant(scales.size(), -1);
  for (const int l : columns)
    if (scales[l] > 0) free[l] = scales[l];
  return free;
}

Observations ObserveForProposal(const Problem& problem, const Transitions& transitions) {
  Declaration declaration = problem.declaration;
  declaration.lipschitz.setZero();
  return Observe(*problem.model, declaration, transitions, problem.timing);
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
        options.estimate_noise && shown > proposed.noise_bound[k]) {
      // As it will be printed: the slopes have to hold with the number that is copied.
      proposed.noise_bound[k] = RoundedToPrint(shown);
      row.is_raised = true;
    }
    const Eigen::RowVectorXd free = FreeScales(scales, options.columns[ToSize(k)]);
    ExamineError(proposed, observations, k, free, options, row);
    row.smallest = FindSmallestRow(proposed, observations, k, free);
    if (row.smallest.unexplained) throw Unexplained(k, *row.smallest.unexplained);
    if (options.advance) options.advance();
  }
  Declaration smallest = proposed;
  for (int k = 0; k < n; ++k) {
    smallest.lipschitz.row(k) = proposal.rows[ToSize(k)].smallest.slopes;
    for (Eigen::Index l = 0; l < scales.size(); ++l)
      proposed.lipschitz(k, l) = RoundedToPrint(options.factor * smallest.lipschitz(k, l));
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
