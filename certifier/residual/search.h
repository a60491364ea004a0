/** max_i (value_i - D_i) over an ObservationIndex, for both sides: value_i is the floor, or the negated ceiling. Scans all
blocks, or goes down the tree and leaves out what cannot beat the best so far; both find the same number to the last bit,
in plain arithmetic. For the inside of lipschitz_envelope.cpp only, as metric.h. */
#pragma once

#include "certifier/residual/metric.h"
#include "certifier/residual/observation_index.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace forereach::internal {

/** What a search may spend, and whether it would have gone on. */
struct Budget {
  int leaves, patterns;
  bool capped = false;
};

struct Sides {
  double floor, negated_ceiling;
};

/** The best of a block's entries against `best`. One that is to be refined is looked at from its most promising entry on. */
template <class Metric>
double BestOfBlock(const Metric& metric, const Pack* block, const Pack& values, const Pack& optimistic, double best, Budget& budget) {
  if constexpr (!Metric::kRefines) {
    return simd::Max(best, MaxLane(optimistic));
  } else {
    for (Pack left = TagLanes(Max(optimistic, simd::Fill(-kMaxDouble)));;) {
      const double next = MaxLane(left);
      if (!(next > best)) return best;
      const std::size_t lane = simd::TaggedLane(next);
      left = Replace(left, next, -kMaxDouble);
      best = simd::Max(best, values.at(lane) - metric.Refine(block, lane, budget.patterns, budget.capped));
    }
  }
}

/** All of `count` blocks in a row. */
template <class Metric>
Sides ScanBlocks(const Metric& metric, const Pack* block, std::size_t count, std::size_t coordinates, Budget& budget) {
  Sides best{-kInfinity, -kInfinity};
  Pack floors = simd::Fill(-kInfinity), ceilings = floors;
  for (const Pack* end = block + count * (coordinates + 2); block != end; block += coordinates + 2) {
    const Pack distance = metric.Block(block), floor = simd::Load(block[coordinates]), ceiling = simd::Load(block[coordinates + 1]);
    if constexpr (Metric::kRefines) {
      best.floor = BestOfBlock(metric, block, floor, floor - distance, best.floor, budget);
      best.negated_ceiling = BestOfBlock(metric, block, ceiling, ceiling - distance, best.negated_ceiling, budget);
    } else {
      floors = Max(floor - distance, floors);
      ceilings = Max(ceiling - distance, ceilings);
    }
  }
  return {simd::Max(best.floor, MaxLane(floors)), simd::Max(best.negated_ceiling, MaxLane(ceilings))};
}

/** One side of a leaf. */
template <class Metric>
double BestOfLeaf(const Metric& metric, const Pack* block, std::size_t coordinates, std::size_t side, double best, Budget& budget) {
  Pack highest = simd::Fill(-kInfinity);
  for (std::size_t b = 0; b < ObservationIndex::kLeafBlocks; ++b, block += coordinates + 2) {
    const Pack values = simd::Load(block[coordinates + side]), optimistic = values - metric.Block(block);
    if constexpr (Metric::kRefines)
      best = BestOfBlock(metric, block, values, optimistic, best, budget);
    else
      highest = Max(optimistic, highest);
  }
  return simd::Max(best, MaxLane(highest));
}

/** Depth first, the most promising child first. @param side 0 for the floors, 1 for the negated ceilings. */
template <class Metric>
double Descend(const Metric& metric, const ObservationIndex& index, std::size_t side, Budget& budget) {
  struct Level {
    Pack bounds;  // of the children not yet visited
    std::size_t first_child;
  };
  std::array<Level, ObservationIndex::kMaxHeight + 1> levels;
  const std::size_t k = index.num_coordinates();
  const int top = index.height();
  double best = -kInfinity;
  int leaves = budget.leaves;
  std::size_t child = 0;
  for (int level = top + 1;;) {
    // Down to the parent of leaves, then to one leaf after the other, and up when nothing there can beat the best.
    if (level > 1) {
      Level& at = levels[static_cast<std::size_t>(--level)];
      at.bounds = TagLanes(metric.Node(index.node(level, child), side));
      at.first_child = child * kLanes;
    } else {
      best = BestOfLeaf(metric, index.block(child * ObservationIndex::kLeafBlocks), k, side, best, budget);
      --leaves;
    }
    double next;
    while (!((next = MaxLane(levels[static_cast<std::size_t>(level)].bounds)) > best))
      if (++level > top) return best;
    if (leaves == 0) {
      budget.capped = true;
      return best;
    }
    Level& at = levels[static_cast<std::size_t>(level)];
    at.bounds = Replace(at.bounds, next, -kMaxDouble);
    child = at.first_child + simd::TaggedLane(next);
  }
}

}  // namespace forereach::internal

#pragma GCC diagnostic pop
