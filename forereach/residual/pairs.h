/** The search of the pairwise test, Eq. (pairwise-falsification): pairs (i, j) of observations of one coordinate k that
may contradict the declaration, floor_i - ceiling_j > d_k(z_i, z_j).

The arithmetic is plain, and the margin exceeds its error. So the suspects contain every contradiction, and the caller
has to test each of them rigorously. Two leaves of an ObservationIndex are compared by their bounds first; their entries
are compared only if the bounds allow a pair. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/lipschitz_row.h"
#include "forereach/residual/observation_index.h"

namespace forereach {

class PairSearch final {
 public:
  /** One observation, in the index or not: its coordinates (LipschitzRow::Map), its floor and its negated ceiling. */
  struct Point {
    std::vector<double> coordinates;
    double floor, negated_ceiling;
  };

  /** @param index must outlive this object. @param margin at least the error of plain arithmetic (PairMarginUpper). */
  PairSearch(const ObservationIndex& index, double margin, InstructionSet instructions = BestInstructionSet())
      : index_(index), margin_(margin), instructions_(instructions) {}

  /** Calls test(i, j) for the suspects, in the order of the index, each unordered pair at most once. Returns true as
  soon as a call does. Cost: O(N log N) if few leaves can hold a pair, O(N^2) at worst. */
  template <class Test>
  bool AnyPair(const Test& test) const;

  /** Calls test(i) for the entries that are suspects with the point. Returns true as soon as a call does. */
  template <class Test>
  bool AnyPartner(const Point& point, const Test& test) const;

  /** Sets `partners` to the suspects of a point among the first `count` entries of adjacent blocks, where entry i is in
  lane i % 8 of block i / 8. */
  static void Suspects(const Point& point, const LipschitzRow& row, const Pack* blocks, std::size_t count,
                       double margin, std::vector<std::uint32_t>& partners);

  /** The entry j other than `self` with the largest v_j - d(point, j), where v is the floor for side 0 and the negated
  ceiling for side 1; or any entry for which that is at least `enough`. An entry that equals the point and has
  an id above `self` is skipped, so that of two equal entries only the later is dominated by the other. Without any
  other entry: kNone. If the margin is infinite, it looks at all entries. */
  struct Other {
    double value = -kInfinity;
    std::uint32_t id = ObservationIndex::kNone;
  };
  [[nodiscard]] Other BestOther(const Point& point, std::size_t side, std::uint32_t self,
                                double enough = kInfinity) const;

  /** Sets `leaves` to the leaves with numbers >= `first` that may hold a partner of a group's entry.
  @param group the bounds of a leaf or a point, as one lane of a node: node_packs() doubles. */
  void Leaves(const std::vector<double>& group, std::size_t first, std::vector<std::size_t>& leaves) const;
  /** Sets `pairs` to the suspects between two leaves, or inside one if they are the same; each pair once. */
  void Suspects(std::size_t leaf, std::size_t other, std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) const;
  /** Sets `partners` to the suspects of a point in a leaf. */
  void Suspects(const Point& point, std::size_t leaf, std::vector<std::uint32_t>& partners) const;

  [[nodiscard]] std::vector<double> GroupOf(std::size_t leaf) const;
  [[nodiscard]] std::vector<double> GroupOf(const Point& point) const;

 private:
  struct Kernel;

  const ObservationIndex& index_;
  double margin_;
  InstructionSet instructions_;
};

/** An upper bound on the error of floor_i - ceiling_j - d(i, j) in plain arithmetic. Infinite if it may overflow.
@param values a bound on every |floor| and |ceiling|. @param locations a bound on sum_l L_kl |z_l|. */
[[nodiscard]] inline double PairMarginUpper(double values, double locations, std::size_t columns) noexcept {
  const double magnitude = MulUp(2, AddUp(values, locations));
  if (!(magnitude < 0x1p960)) return kInfinity;
  return PlainErrorUpper(magnitude, 2 * (static_cast<int>(columns) + 8), 4 * static_cast<int>(columns));
}

/** PairMarginUpper for all pairs of the given observations. */
[[nodiscard]] double MarginUpper(const LipschitzRow& row, const ObservationIndex::Entries& entries,
                                 const Observations& observations);

/** Calls take(rows) for each set of observations that have one location in the columns of `row`, which may be
reordered; ascending. So what holds of a pair for its locations is asked once for all of them. Cost O(N log N). */
template <class Take>
void ForEachLocation(const LipschitzRow& row, const Observations& observations, const Take& take);

[[nodiscard]] PairSearch::Point PointOf(const ObservationIndex::Entries& entries, int i);

template <class Take>
void ForEachLocation(const LipschitzRow& row, const Observations& o, const Take& take) {
  const auto order = [&](int i, int j) {
    for (const LipschitzRow::Column& column : row.columns())
      if (const double a = o.z(i, column.variable), b = o.z(j, column.variable); a != b) return a < b ? -1 : 1;
    return 0;
  };
  std::vector<int> rows(ToSize(o.size()));
  std::iota(rows.begin(), rows.end(), 0);
  std::ranges::sort(rows, [&](int i, int j) {
    const int before = order(i, j);
    return before < 0 || (before == 0 && i < j);
  });
  for (auto begin = rows.begin(); begin != rows.end();) {
    const int first = *begin;
    const auto end = std::find_if(begin, rows.end(), [&](int i) { return order(first, i) != 0; });
    take(std::span<int>(begin, end));
    begin = end;
  }
}

template <class Test>
bool PairSearch::AnyPair(const Test& test) const {
  std::vector<std::size_t> leaves;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::size_t leaf = 0; leaf < index_.num_leaves(); ++leaf) {
    Leaves(GroupOf(leaf), leaf, leaves);
    for (const std::size_t other : leaves) {
      Suspects(leaf, other, pairs);
      for (const auto& [i, j] : pairs)
        if (test(i, j)) return true;
    }
  }
  return false;
}

template <class Test>
bool PairSearch::AnyPartner(const Point& point, const Test& test) const {
  std::vector<std::size_t> leaves;
  std::vector<std::uint32_t> partners;
  Leaves(GroupOf(point), 0, leaves);
  for (const std::size_t leaf : leaves) {
    Suspects(point, leaf, partners);
    for (const std::uint32_t j : partners)
      if (test(j)) return true;
  }
  return false;
}

}  // namespace forereach
