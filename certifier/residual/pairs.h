/** Pairs of observations in one residual coordinate that may contradict the declaration: floor_i - ceiling_j > d(i, j).

Plain arithmetic with a margin above its error, so that no contradiction is missed; whoever asks has to test the
suspects exactly. Leaves of an ObservationIndex are compared by what its nodes know of them, and entries only where two
leaves may hold a pair. */
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "certifier/numerics/instruction_set.h"
#include "certifier/residual/lipschitz_row.h"
#include "certifier/residual/observation_index.h"

namespace forereach {

class PairSearch final {
 public:
  /** One observation outside the index or in it: coordinates as in the index, floor and negated ceiling. */
  struct Point {
    std::vector<double> coordinates;
    double floor, negated_ceiling;
  };

  /** @param margin not below the error of plain arithmetic: PairMarginUpper. The index has to outlive this. */
  PairSearch(const ObservationIndex& index, double margin, InstructionSet instructions = BestInstructionSet())
      : index_(index), margin_(margin), instructions_(instructions) {}

  /** Calls test(id, id) for the suspects until one returns true, which is then the answer. Every unordered pair at most
  once; the order is that of the index. */
  template <class Test>
  bool AnyPair(const Test& test) const;

  /** Calls test(id) for all entries that are suspects with the point until one returns true. */
  template <class Test>
  bool AnyPartner(const Point& point, const Test& test) const;

  /** Suspects of a point among the first `count` entries of blocks that lie in the order of their numbers. */
  static void Suspects(const Point& point, const LipschitzRow& row, const Pack* blocks, std::size_t count,
                       double margin, std::vector<std::uint32_t>& partners);

  /** The entry other than `self` that says most about the point on one side: the largest v_j - d(point, j), v the floor
  for side 0 and the negated ceiling for side 1. An entry that is the same as the point there, and whose id is above
  `self`, does not count: of two that are the same, only the later has one that says as much. */
  struct Other {
    double value = -kInfinity;
    std::uint32_t id = ObservationIndex::kNone;
  };
  [[nodiscard]] Other BestOther(const Point& point, std::size_t side, std::uint32_t self) const;

  /** Leaves that may hold a partner, from number `first` on. Group: as a node's child, node_packs() doubles. */
  void Leaves(const std::vector<double>& group, std::size_t first, std::vector<std::size_t>& leaves) const;
  /** Suspects of a leaf with another or with itself, each pair once. */
  void Suspects(std::size_t leaf, std::size_t other, std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) const;
  /** Suspects of a point with a leaf. */
  void Suspects(const Point& point, std::size_t leaf, std::vector<std::uint32_t>& partners) const;

  [[nodiscard]] std::vector<double> GroupOf(std::size_t leaf) const;
  [[nodiscard]] std::vector<double> GroupOf(const Point& point) const;

 private:
  struct Kernel;

  const ObservationIndex& index_;
  double margin_;
  InstructionSet instructions_;
};

/** What plain arithmetic may be off by in floor_i - ceiling_j - d(i, j), where every |floor| and |ceiling| is at most
`values` and sum_l L_kl |z_l| at most `locations`. Infinite where it may overflow. */
[[nodiscard]] inline double PairMarginUpper(double values, double locations, std::size_t columns) noexcept {
  const double magnitude = MulUp(2, AddUp(values, locations));
  if (!(magnitude < 0x1p960)) return kInfinity;
  return PlainErrorUpper(magnitude, 2 * (static_cast<int>(columns) + 8), 4 * static_cast<int>(columns));
}

/** The same for all pairs of the given observations. */
[[nodiscard]] double MarginUpper(const LipschitzRow& row, const ObservationIndex::Entries& entries,
                                 const Observations& observations);

[[nodiscard]] PairSearch::Point PointOf(const ObservationIndex::Entries& entries, int i);

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
