/** The search of the envelope, Eq. (set-envelope): max_i (v_i - D_i) over the entries i of an ObservationIndex, once
with v_i = floor_i and once with v_i = -ceiling_i. D_i is the distance of the query set to entry i (metric.h).

ScanBlocks looks at all blocks. SearchTree goes down the tree and skips every child whose bound does not exceed the best
value so far. Both give the same bits, in plain arithmetic. Only lipschitz_envelope.cpp includes this file. */
#pragma once

#include "forereach/numerics/size.h"
#include "forereach/residual/metric.h"
#include "forereach/residual/observation_index.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace forereach::internal {

/** The limits on the work of a search. A search that meets one sets `capped`; its result is still sound. */
struct Budget {
  int leaves;    ///< that one search for one side may visit
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

/** Both maxima over `count` adjacent blocks. */
template <class Metric>
Sides ScanBlocks(const Metric& metric, const Pack* block, std::size_t count, std::size_t coordinates, Budget&) {
  Pack floors = Fill(-kInfinity), ceilings = Fill(-kInfinity);
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
                                           std::size_t coordinates, Budget& budget) {
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
  std::array<double, 2> best{-kInfinity, -kInfinity};
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

/** The larger of `best` and the maximum over one leaf, for one side. */
template <class Metric>
double BestOfLeaf(const Metric& metric, const Pack* block, std::size_t coordinates, std::size_t side, double best,
                  Budget& budget) {
  Pack highest = Fill(-kInfinity);
  for (std::size_t b = 0; b < ObservationIndex::kLeafBlocks; ++b, block += coordinates + 2) {
    const Pack values = LoadPack(block[coordinates + side]), optimistic = values - metric.Block(block);
    if constexpr (Metric::kRefines)
      best = BestOfBlock(metric, block, values, optimistic, best, budget);
    else
      highest = Max(optimistic, highest);
  }
  return Max(best, MaxLane(highest));
}

/** The search of one side of an index: depth first, the child with the largest bound first. It proceeds in steps, so
that two searches can alternate and hide the latency of comparisons and memory. */
template <class Metric>
class Descent {
 public:
  /** @param side 0 for the floors, 1 for the negated ceilings. */
  Descent(const Metric& metric, const ObservationIndex& index, std::size_t side, int max_leaves)
      : metric_(metric), index_(index), side_(side), leaves_(max_leaves), level_(index.height() + 1) {}

  /** Visits one node or one leaf, then selects the next child whose bound exceeds the best. False if there is none, or
  if the budget allows no further leaf. */
  bool Step(Budget& budget) {
    if (level_ > 1) {
      Level& at = levels_[ToSize(--level_)];
      at.bounds = TagLanes(metric_.Node(index_.node(level_, child_), side_));
      at.first_child = child_ * kPackSize;
    } else {
      best_ = BestOfLeaf(metric_, index_.leaf(child_), index_.num_coordinates(), side_, best_, budget);
      --leaves_;
    }
    double next;
    while (!((next = MaxLane(levels_[ToSize(level_)].bounds)) > Max(best_, ObservationIndex::kMissing)))
      if (++level_ > index_.height()) return false;
    budget.capped |= leaves_ == 0;
    if (leaves_ == 0) return false;
    Level& at = levels_[ToSize(level_)];
    at.bounds = Replace(at.bounds, next, -kMaxDouble);
    child_ = at.first_child + TaggedLane(next);
    Prefetch();
    return true;
  }

  [[nodiscard]] double best() const { return best_; }

 private:
  struct Level {
    Pack bounds;  // of the children not yet visited
    std::size_t first_child;
  };

  void Prefetch() const {
    if (level_ > 1) {
      const Pack* node = index_.node(level_ - 1, child_);
      for (std::size_t p = 0; p < index_.node_packs() / 2; ++p)
        __builtin_prefetch(node + side_ * index_.node_packs() / 2 + p);
    } else {
      const Pack* leaf = index_.leaf(child_);
      for (std::size_t p = 0; p < ObservationIndex::kLeafBlocks * index_.block_packs(); ++p)
        __builtin_prefetch(leaf + p);
    }
  }

  const Metric& metric_;
  const ObservationIndex& index_;
  const std::size_t side_;
  int leaves_, level_;
  std::size_t child_ = 0;
  double best_ = -kInfinity;
  std::array<Level, ObservationIndex::kMaxHeight + 1> levels_;
};

template <class Metric>
Sides SearchTree(const Metric& metric, const ObservationIndex& index, Budget& budget) {
  Descent<Metric> floors(metric, index, 0, budget.leaves), ceilings(metric, index, 1, budget.leaves);
  for (bool more_floors = true, more_ceilings = true; more_floors || more_ceilings;) {
    if (more_floors) more_floors = floors.Step(budget);
    if (more_ceilings) more_ceilings = ceilings.Step(budget);
  }
  return {floors.best(), ceilings.best()};
}

}  // namespace forereach::internal

#pragma GCC diagnostic pop
