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

inline const Pack kMinusInfinities = simd::Fill(-kInfinity);

/** The best of a block's entries against `best`, exactly evaluated from the most promising one on. */
template <class Metric>
double BestOfBlock(const Metric& metric, const Pack* block, const Pack& values, Pack optimistic, double best, Budget& budget) {
  if constexpr (!Metric::kRefines) {
    return simd::Max(best, MaxLane(optimistic));
  } else {
    for (;;) {
      const double next = MaxLane(optimistic);
      if (!(next > best)) return best;
      const std::size_t lane = LaneOf(optimistic, next);
      optimistic.set(lane, -kInfinity);
      best = simd::Max(best, values.at(lane) - metric.Refine(block, lane, budget.patterns, budget.capped));
    }
  }
}

template <class Metric>
Sides ScanBlocks(const Metric& metric, const Pack* blocks, std::size_t count, std::size_t coordinates, Budget& budget) {
  Sides best{-kInfinity, -kInfinity};
  if constexpr (!Metric::kRefines) {
    Pack floor = kMinusInfinities, negated_ceiling = kMinusInfinities;
    for (std::size_t b = 0; b < count; ++b, blocks += coordinates + 2) {
      const Pack distance = metric.Block(blocks);
      floor = Max(simd::Load(blocks[coordinates]) - distance, floor);
      negated_ceiling = Max(simd::Load(blocks[coordinates + 1]) - distance, negated_ceiling);
    }
    best = {MaxLane(floor), MaxLane(negated_ceiling)};
  } else {
    for (std::size_t b = 0; b < count; ++b, blocks += coordinates + 2) {
      const Pack distance = metric.Block(blocks);
      const Pack floors = simd::Load(blocks[coordinates]), ceilings = simd::Load(blocks[coordinates + 1]);
      best.floor = BestOfBlock(metric, blocks, floors, floors - distance, best.floor, budget);
      best.negated_ceiling = BestOfBlock(metric, blocks, ceilings, ceilings - distance, best.negated_ceiling, budget);
    }
  }
  return best;
}

/** Depth first, the most promising child first. @param side 0 for the floors, 1 for the negated ceilings. */
template <class Metric>
double Descend(const Metric& metric, const ObservationIndex& index, std::size_t side, double best, Budget& budget) {
  struct Level {
    Pack optimistic;
    std::size_t first_child;
  };
  const std::size_t k = index.num_coordinates();
  std::array<Level, ObservationIndex::kMaxHeight + 1> levels;
  const int top = index.height();
  const auto enter = [&](int level, std::size_t i) {
    const Pack* node = index.node(level, i);
    levels[static_cast<std::size_t>(level)] = {simd::Load(node[2 * k + side]) - metric.Node(node), i * kLanes};
  };
  enter(top, 0);
  int leaves = budget.leaves;
  for (int level = top; level <= top;) {
    Level& at = levels[static_cast<std::size_t>(level)];
    const double next = MaxLane(at.optimistic);
    if (!(next > best)) {
      ++level;
      continue;
    }
    if (leaves == 0) {
      budget.capped = true;
      break;
    }
    const std::size_t lane = LaneOf(at.optimistic, next), child = at.first_child + lane;
    at.optimistic.set(lane, -kInfinity);
    if (level > 1) {
      enter(--level, child);
      continue;
    }
    --leaves;
    const Pack* block = index.block(child);
    const Pack values = simd::Load(block[k + side]);
    best = BestOfBlock(metric, block, values, values - metric.Block(block), best, budget);
  }
  return best;
}

}  // namespace forereach::internal

#pragma GCC diagnostic pop
