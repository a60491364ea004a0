#include "identify/hold_out.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <boost/math/distributions/binomial.hpp>

#include "forereach/numerics/size.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/lipschitz_row.h"
#include "forereach/residual/observation_index.h"
#include "forereach/residual/pairs.h"
#include "identify/affine_proposal.h"

namespace forereach {
namespace {

Observations Joined(const Observations& a, const Observations& b) {
  Observations both{Eigen::MatrixXd(a.size() + b.size(), a.z.cols()),
                    Eigen::MatrixXd(a.size() + b.size(), a.num_states()),
                    Eigen::MatrixXd(a.size() + b.size(), a.num_states())};
  both.z << a.z, b.z;
  both.lower << a.lower, b.lower;
  both.upper << a.upper, b.upper;
  return both;
}

// For coordinate k: which of the observations from `first` on contradict one of those before.
void Mark(const Declaration& declaration, const Observations& all, int first, int k, std::vector<bool>& contradicts) {
  const LipschitzRow row(declaration, k);
  const auto test = [&](int i, int j) { return TestPair(declaration, all, i, j, k).has_value(); };
  if (row.is_constant()) {  // all pairs count alike, and the two extremes contradict if any does
    int highest = 0, lowest = 0;
    for (int i = 1; i < first; ++i) {
      if (all.lower(i, k) > all.lower(highest, k)) highest = i;
      if (all.upper(i, k) < all.upper(lowest, k)) lowest = i;
    }
    for (int j = first; j < all.size(); ++j)
      if (test(highest, j) || test(lowest, j)) contradicts[ToSize(j - first)] = true;
    return;
  }
  const Observations learned{all.z.topRows(first), all.lower.topRows(first), all.upper.topRows(first)};
  const ObservationIndex index(EntriesOf(row, declaration, learned, k));
  const auto entries = EntriesOf(row, declaration, all, k);
  const PairSearch search(index, MarginUpper(row, entries, all));
  for (int j = first; j < all.size(); ++j)
    if (search.AnyPartner(PointOf(entries, j), [&](std::uint32_t i) { return test(static_cast<int>(i), j); }))
      contradicts[ToSize(j - first)] = true;
}

// The same for an affine row: what the first observations allow at the place of another misses what that one shows.
void MarkAffine(const AffineSet& set, const Declaration& declaration, const Observations& judged, int k,
                std::vector<bool>& contradicts) {
  const double error = declaration.ObservationError(k);
  for (int j = 0; j < judged.size(); ++j) {
    const Eigen::VectorXd z = judged.z.row(j);
    const Interval allowed = set.Enclose({z.data(), ToSize(z.size())});
    if (SubDown(judged.lower(j, k), error) > allowed.upper || AddUp(judged.upper(j, k), error) < allowed.lower)
      contradicts[ToSize(j)] = true;
  }
}

}  // namespace

Split SplitByTime(int count, int blocks) {
  if (!(2 <= blocks && blocks <= count))
    throw std::invalid_argument(
        fmt::format("{} blocks of {} transitions: there have to be between 2 and {}", blocks, count, count));
  Split split;
  const auto begin_of = [&](int b) { return static_cast<int>(static_cast<std::int64_t>(count) * b / blocks); };
  for (int b = 0; b < blocks; ++b) (b % 2 == 0 ? split.learn : split.judge).push_back({begin_of(b), begin_of(b + 1)});
  return split;
}

Transitions RowsOf(const Transitions& transitions, const std::vector<Split::Block>& blocks) {
  Eigen::Index rows = 0;
  for (const Split::Block& block : blocks) rows += block.size();
  Transitions part{Eigen::MatrixXd(rows, transitions.z.cols()), Eigen::MatrixXd(rows, transitions.x_next.cols())};
  if (transitions.longer.size() > 0) part.longer.resize(rows);
  rows = 0;
  for (const Split::Block& block : blocks) {
    part.z.middleRows(rows, block.size()) = transitions.z.middleRows(block.begin, block.size());
    part.x_next.middleRows(rows, block.size()) = transitions.x_next.middleRows(block.begin, block.size());
    if (part.longer.size() > 0)
      part.longer.segment(rows, block.size()) = transitions.longer.segment(block.begin, block.size());
    rows += block.size();
  }
  return part;
}

ContradictionCounts CountContradictions(const Problem& problem, const Declaration& declaration, const Split& split) {
  const auto observe = [&](const std::vector<Split::Block>& blocks) {
    return Observe(*problem.model, declaration, RowsOf(problem.transitions, blocks), problem.timing);
  };
  const Observations learned = observe(split.learn), judged = observe(split.judge);
  const Observations all = Joined(learned, judged);
  std::vector<bool> contradicts(ToSize(judged.size()), false);
  for (int k = 0; k < all.num_states(); ++k)
    if (declaration.affine.Contains(k))
      MarkAffine(AffineSetOf(declaration, learned, k, problem.domain), declaration, judged, k, contradicts);
    else
      Mark(declaration, all, learned.size(), k, contradicts);
  ContradictionCounts found;
  found.transitions = judged.size();
  found.contradicting = static_cast<int>(std::ranges::count(contradicts, true));
  auto at = contradicts.begin();
  for (const Split::Block& block : split.judge) {
    const auto end = at + block.size();
    ++found.blocks;
    if (std::find(at, end, true) != end) ++found.blocks_contradicting;
    at = end;
  }
  return found;
}

std::vector<HoldOutWindow> WindowsOf(const Transitions& transitions, const Split& split, int steps) {
  std::vector<HoldOutWindow> windows;
  const Eigen::Index n = transitions.x_next.cols();
  for (const Split::Block& block : split.judge)
    for (int begin = block.begin, i = begin; i < block.end; ++i) {
      // It does not begin where the one before it ended: a row was lost, or another log begins.
      if (i > begin && transitions.z.row(i).head(n) != transitions.x_next.row(i - 1)) begin = i;
      if (i + 1 - begin < steps) continue;
      windows.push_back({begin, steps});
      begin = i + 1;
    }
  return windows;
}

// The library's error is some units in the last place; the margin is far above it.
double ProbabilityUpper(int count, int trials, double confidence) {
  constexpr double kMargin = 1 + 1e-9;
  if (count >= trials) return 1;
  const double bound = boost::math::binomial_distribution<double>::find_upper_bound_on_p(trials, count, 1 - confidence);
  return std::min(1.0, bound * kMargin);
}

}  // namespace forereach
