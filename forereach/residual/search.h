/** The search of the envelope, Eq. (set-envelope): max_i (v_i - D_i) over the entries i of an ObservationIndex, once
with v_i = floor_i and once with v_i = -ceiling_i. D_i is the distance of the query set to entry i (metric.h).

ScanBlocks looks at all blocks. TreeSearch looks where the last search found its bounds, and then goes down the tree,
the child of highest bound first, past every one whose bound exceeds neither of the best values so far. Both give the
same bits, in plain arithmetic. Only lipschitz_envelope.cpp includes this file. */
#pragma once

#include <bit>
#include <cstdint>

#include "forereach/numerics/size.h"
#include "forereach/residual/metric.h"
#include "forereach/residual/observation_index.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace forereach::internal {

/** The limits on the work of a search. A search that meets one sets `capped`; its result is still sound. */
struct Budget {
  int leaves;    ///< that one search may visit
  int patterns;  ///< of signs that SignMetric::Refine may try
  bool capped = false;
};

/** The largest number of blocks that ScanBlocks takes if the metric refines entries. */
inline constexpr std::size_t kMaxRefinedBlocks = 128;

struct Sides {
  double floor, negated_ceiling;
};

/** The larger of `best` and the block's max_i (v_i - D_i). If the metric refines, entries are refined in the order of
their bounds, until no bound exceeds the best. @param optimistic upper bounds on v_i - D_i; the values themselves if the
metric does not refine. */
template <class Metric>
double BestOfBlock(const Metric& metric, const Pack* block, const Pack& values, const Pack& optimistic, double best,
                   Budget& budget) {
  if constexpr (!Metric::kRefines) {
    return Max(best, MaxLane(optimistic));
  } else {
    for (Pack left = TagLanes(Max(optimistic, Fill(-kMaxDouble)));;) {
      const double next = MaxLane(left);
      if (!(next > Max(best, ObservationIndex::kMissing))) return best;
      const std::size_t lane = TaggedLane(next);
      left = Replace(left, next, -kMaxDouble);
      best = Max(best, values.at(lane) - metric.Refine(block, lane, budget.patterns, budget.capped));
    }
  }
}

/** `best`, raised to both maxima over `count` adjacent blocks. */
template <class Metric>
Sides ScanBlocks(const Metric& metric, const Pack* block, std::size_t count, const Sides& best, Budget&) {
  const std::size_t coordinates = metric.coordinates();
  Pack floors = Fill(best.floor), ceilings = Fill(best.negated_ceiling);
  for (const Pack* end = block + count * (coordinates + 2); block != end; block += coordinates + 2) {
    const Pack distance = metric.Block(block);
    floors = Max(LoadPack(block[coordinates]) - distance, floors);
    ceilings = Max(LoadPack(block[coordinates + 1]) - distance, ceilings);
  }
  return {MaxLane(floors), MaxLane(ceilings)};
}

/** The same if the metric refines: first the block with the largest bound, then the blocks whose bounds exceed the
best. */
template <class Metric>
requires Metric::kRefines Sides ScanBlocks(const Metric& metric, const Pack* blocks, std::size_t count,
                                           const Sides& before, Budget& budget) {
  const std::size_t coordinates = metric.coordinates();
  std::array<std::array<Pack, kMaxRefinedBlocks>, 2> optimistic;
  std::array<std::array<double, kMaxRefinedBlocks>, 2> highest;
  std::array<std::size_t, 2> first{0, 0};
  std::array<double, 2> top{-kInfinity, -kInfinity};
  for (std::size_t b = 0; b < count; ++b) {
    const Pack* block = blocks + b * (coordinates + 2);
    const Pack distance = metric.Block(block);
    for (std::size_t side = 0; side < 2; ++side) {
      optimistic[side][b] = LoadPack(block[coordinates + side]) - distance;
      highest[side][b] = MaxLane(optimistic[side][b]);
      first[side] = highest[side][b] > top[side] ? b : first[side];
      top[side] = Max(highest[side][b], top[side]);
    }
  }
  std::array<double, 2> best{before.floor, before.negated_ceiling};
  for (std::size_t side = 0; side < 2; ++side) {
    const auto refine = [&](std::size_t b) {
      const Pack* block = blocks + b * (coordinates + 2);
      best[side] = BestOfBlock(metric, block, block[coordinates + side], optimistic[side][b], best[side], budget);
    };
    refine(first[side]);
    for (std::size_t b = 0; b < count; ++b)
      if (b != first[side] && highest[side][b] > best[side]) refine(b);
  }
  return {best[0], best[1]};
}

/** The search of an index: first the leaves in which the last one found its bounds, then depth first what may hold a
better one. */
template <class Metric>
class TreeSearch {
 public:
  /** @param found where to begin; set to where the bounds are. */
  TreeSearch(const Metric& metric, const ObservationIndex& index, FoundIn& found, Budget& budget)
      : metric_(metric), index_(index), found_(found), budget_(budget), leaves_(budget.leaves) {}

  Sides Run() {
    first_ = second_ = LeafToBegin(found_.lower, 0);
    const std::size_t second = LeafToBegin(found_.upper, 1);
    Visit(first_);
    if (second != first_ && leaves_ > 0) Visit(second_ = second);
    // The bound of a root with two children says little.
    const int top =
        index_.height() > 1 && index_.num_nodes(index_.height() - 1) == 2 ? index_.height() - 1 : index_.height();
    for (std::size_t node = 0; node < index_.num_nodes(top); ++node) {
      Open(top, node);
      while (level_ <= top) {
        Level& at = levels_[ToSize(level_)];
        const unsigned better = Better(at) & at.left;
        if (better == 0) {
          ++level_;
          continue;
        }
        const std::size_t lane = BestOf(better, at);
        at.left &= ~(1u << lane);
        const std::size_t child = at.first_child + lane;
        if (level_ > 1) {
          Open(level_ - 1, child);
        } else if (leaves_ > 0) {
          Visit(child);
        } else {
          budget_.capped = true;
          return best_;
        }
      }
    }
    return best_;
  }

 private:
  struct Level {
    Pack floors, negated_ceilings;  // bounds of the children
    std::size_t first_child;
    unsigned left;  // a bit for each child that is not yet passed
  };

  // Where the last search found the bound of one side; else by the child with the highest bound on every level.
  [[nodiscard]] std::size_t LeafToBegin(std::uint32_t found, std::size_t side) const {
    if (found < index_.num_leaves()) return found;
    std::size_t child = 0;
    for (int level = index_.height(); level >= 1; --level) {
      const Pack bounds = metric_.Node(index_.node(level, child), side);
      child = child * kPackSize + TaggedLane(MaxLane(TagLanes(Max(bounds, Fill(-kMaxDouble)))));
    }
    return child;
  }

  void Visit(std::size_t leaf) {
    const Sides best = ScanBlocks(metric_, index_.leaf(leaf), ObservationIndex::kLeafBlocks, best_, budget_);
    if (best.floor > best_.floor) found_.lower = static_cast<std::uint32_t>(leaf);
    if (best.negated_ceiling > best_.negated_ceiling) found_.upper = static_cast<std::uint32_t>(leaf);
    best_ = best;
    --leaves_;
  }

  void Open(int level, std::size_t node) {
    level_ = level;
    Level& at = levels_[ToSize(level)];
    at.floors = metric_.Node(index_.node(level, node), 0);
    at.negated_ceilings = metric_.Node(index_.node(level, node), 1);
    at.first_child = node * kPackSize;
    at.left = level > 1 ? ~0u : ~(BitIn(node, first_) | BitIn(node, second_));
  }

  [[nodiscard]] static unsigned BitIn(std::size_t node, std::size_t leaf) {
    return static_cast<unsigned>(leaf / kPackSize == node) << leaf % kPackSize;
  }

  // Of the children with these bits, the one whose bound exceeds the best of its side by most.
  [[nodiscard]] std::size_t BestOf(unsigned better, const Level& at) const {
    std::size_t best = 0;
    for (double most = -kInfinity; better != 0; better &= better - 1) {
      const auto lane = ToSize(std::countr_zero(better));
      const double gain = Max(at.floors.at(lane) - best_.floor, at.negated_ceilings.at(lane) - best_.negated_ceiling);
      best = gain > most ? lane : best;
      most = Max(gain, most);
    }
    return best;
  }

  // A bit for each child whose bound exceeds the best of its side. That of a missing child does not.
  [[nodiscard]] unsigned Better(const Level& at) const {
    const Lanes floor = AllLanes(best_.floor), ceiling = AllLanes(best_.negated_ceiling);
    return BitsOf((at.floors.low > floor) | (at.negated_ceilings.low > ceiling)) |
           BitsOf((at.floors.high > floor) | (at.negated_ceilings.high > ceiling)) << kLaneCount;
  }

  const Metric& metric_;
  const ObservationIndex& index_;
  FoundIn& found_;
  Budget& budget_;
  int leaves_, level_ = 0;
  std::size_t first_ = 0, second_ = 0;  // the leaves in which the search began, perhaps one
  Sides best_{-kInfinity, -kInfinity};
  std::array<Level, ObservationIndex::kMaxHeight + 1> levels_;
};

}  // namespace forereach::internal

#pragma GCC diagnostic pop
