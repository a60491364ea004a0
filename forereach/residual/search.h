/** The search of the envelope, Eq. (set-envelope): max_i (v_i - D_i) over the entries i of an ObservationIndex, once
with v_i = floor_i and once with v_i = -ceiling_i. D_i is the distance of the query set to entry i (metric.h).

ScanBlocks looks at all blocks. TreeSearch looks where the last search found its bounds, and then at every leaf, or down
the tree once for each side, past every child whose bound does not exceed the best value so far. Both give the same
bits, in plain arithmetic. Only lipschitz_envelope.cpp includes this file. */
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
double BestOfBlock(const Metric& metric, const Pack* block, const Pack& values,
                   const typename Metric::InRegisters& optimistic, double best, Budget& budget) {
  using P = typename Metric::InRegisters;
  if constexpr (!Metric::kRefines) {
    return Max(best, MaxLane(optimistic));
  } else {
    for (P left = TagLanes(Max(optimistic, P(Packs<P>::Fill(-kMaxDouble))));;) {
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
  using P = typename Metric::InRegisters;
  const std::size_t coordinates = metric.coordinates();
  P floors = Packs<P>::Fill(best.floor), ceilings = Packs<P>::Fill(best.negated_ceiling);
  for (const Pack* end = block + count * (coordinates + 2); block != end; block += coordinates + 2) {
    const P distance = metric.Block(block);
    floors = Max(Packs<P>::Load(block[coordinates]) - distance, floors);
    ceilings = Max(Packs<P>::Load(block[coordinates + 1]) - distance, ceilings);
  }
  return {MaxLane(floors), MaxLane(ceilings)};
}

/** The same if the metric refines: first the block with the largest bound, then the blocks whose bounds exceed the
best. */
template <class Metric>
requires Metric::kRefines Sides ScanBlocks(const Metric& metric, const Pack* blocks, std::size_t count,
                                           const Sides& before, Budget& budget) {
  using P = typename Metric::InRegisters;
  const std::size_t coordinates = metric.coordinates();
  std::array<std::array<P, kMaxRefinedBlocks>, 2> optimistic;
  std::array<std::array<double, kMaxRefinedBlocks>, 2> highest;
  std::array<std::size_t, 2> first{0, 0};
  std::array<double, 2> top{-kInfinity, -kInfinity};
  for (std::size_t b = 0; b < count; ++b) {
    const Pack* block = blocks + b * (coordinates + 2);
    const P distance = metric.Block(block);
    for (std::size_t side = 0; side < 2; ++side) {
      optimistic[side][b] = Packs<P>::Load(block[coordinates + side]) - distance;
      highest[side][b] = MaxLane(optimistic[side][b]);
      first[side] = highest[side][b] > top[side] ? b : first[side];
      top[side] = Max(highest[side][b], top[side]);
    }
  }
  std::array<double, 2> best{before.floor, before.negated_ceiling};
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t i = 0; i <= count; ++i) {
      const std::size_t b = i == 0 ? first[side] : i - 1;
      if (i > 0 && (b == first[side] || !(highest[side][b] > best[side]))) continue;
      const Pack* block = blocks + b * (coordinates + 2);
      best[side] = BestOfBlock(metric, block, block[coordinates + side], optimistic[side][b], best[side], budget);
    }
  return {best[0], best[1]};
}

/** The larger of `best` and the maximum over one leaf, for one side. */
template <class Metric>
double BestOfLeaf(const Metric& metric, const Pack* block, std::size_t side, double best, Budget& budget) {
  using P = typename Metric::InRegisters;
  const std::size_t coordinates = metric.coordinates();
  P highest = Packs<P>::Fill(-kInfinity);
  for (std::size_t b = 0; b < ObservationIndex::kLeafBlocks; ++b, block += coordinates + 2) {
    const Pack& values = block[coordinates + side];
    const P optimistic = Packs<P>::Load(values) - metric.Block(block);
    if constexpr (Metric::kRefines)
      best = BestOfBlock(metric, block, values, optimistic, best, budget);
    else
      highest = Max(optimistic, highest);
  }
  return Max(best, MaxLane(highest));
}

/** A search for one side, 0 the floors and 1 the negated ceilings, in a tree: depth first, the child with the largest
bound first. It proceeds in steps, so that two searches can alternate and hide the latency of comparisons and memory. */
template <class Metric, std::size_t kSide>
class Descent {
  using P = typename Metric::InRegisters;

 public:
  /** @param best what was found in the leaf `found`, which is passed. */
  Descent(const Metric& metric, const ObservationIndex& index, double best, std::uint32_t found)
      : metric_(metric), index_(index), began_(found), best_(best), found_(found) {}

  /** Visits one node or one leaf, then selects the next child whose bound exceeds the best. False if there is none, or
  if the budget allows no further leaf. */
  bool Step(Budget& budget) {
    if (level_ > 1) {
      Level& at = levels_[ToSize(--level_)];
      at.bounds = TagLanes(metric_.Node(index_.node(level_, child_), kSide));
      at.first_child = child_ * kPackSize;
      if (level_ == 1) at.bounds = Without(at.bounds, began_ - at.first_child);
    } else {
      const double best = BestOfLeaf(metric_, index_.leaf(child_), kSide, best_, budget);
      found_ = best > best_ ? static_cast<std::uint32_t>(child_) : found_;
      best_ = best;
    }
    double next;
    while (!((next = MaxLane(levels_[ToSize(level_)].bounds)) > best_))
      if (++level_ > index_.height()) return false;
    budget.capped |= budget.leaves <= 0;
    if (budget.leaves <= 0) return false;
    Level& at = levels_[ToSize(level_)];
    at.bounds = Replace(at.bounds, next, -kMaxDouble);
    child_ = at.first_child + TaggedLane(next);
    budget.leaves -= level_ == 1;
    Prefetch();
    return true;
  }

  [[nodiscard]] double best() const { return best_; }
  /** The leaf that holds it. */
  [[nodiscard]] std::uint32_t found() const { return found_; }

 private:
  struct Level {
    P bounds;  // of the children not yet visited
    std::size_t first_child;
  };

  FOREREACH_INLINE static P Without(const P& bounds, std::size_t lane) {
    const Lanes missing = AllLanes(-kMaxDouble);
    return Packs<P>::Join(AtLane(lane) ? missing : Low(bounds), AtLane(lane - kLaneCount) ? missing : High(bounds));
  }

  void Prefetch() const {
    const bool is_leaf = level_ == 1;
    const std::size_t packs = is_leaf ? ObservationIndex::kLeafBlocks * index_.block_packs() : index_.node_packs() / 2;
    const Pack* first = is_leaf ? index_.leaf(child_) : index_.node(level_ - 1, child_) + kSide * packs;
    for (std::size_t p = 0; p < packs; ++p) __builtin_prefetch(first + p);
  }

  const Metric& metric_;
  const ObservationIndex& index_;
  const std::size_t began_;  // a leaf
  int level_ = index_.height() + 1;
  std::size_t child_ = 0;
  double best_;
  std::uint32_t found_;
  std::array<Level, ObservationIndex::kMaxHeight + 1> levels_;
};

/** The search of an index: first the leaves in which the last one found its bounds, then what may hold a better one. A
leaf that both descents visit counts twice. */
template <class Metric>
class TreeSearch {
  using P = typename Metric::InRegisters;

 public:
  /** @param found where to begin; set to where the bounds are. */
  TreeSearch(const Metric& metric, const ObservationIndex& index, FoundIn& found, Budget& budget)
      : metric_(metric), index_(index), found_(found), budget_(budget) {}

  Sides Run() {
    const std::size_t first = LeafToBegin(found_.lower, 0);
    std::size_t second = LeafToBegin(found_.upper, 1);
    Visit(first);
    if (budget_.leaves <= 0) second = first;  // is not visited, and not passed
    if (second != first) Visit(second);
    index_.num_nodes(1) <= kFewNodes ? VisitLeaves(first, second) : Descend();
    return best_;
  }

 private:
  static constexpr std::size_t kFewNodes = 8;  // over 2048 observations

  // Where the last search found the bound of one side; else by the child with the highest bound on every level.
  [[nodiscard]] std::size_t LeafToBegin(std::uint32_t found, std::size_t side) const {
    if (found < index_.num_leaves()) return found;
    std::size_t child = 0;
    for (int level = index_.height(); level >= 1; --level)
      child = child * kPackSize + TaggedLane(MaxLane(TagLanes(metric_.Node(index_.node(level, child), side))));
    return child;
  }

  void Visit(std::size_t leaf) {
    const Sides best = ScanBlocks(metric_, index_.leaf(leaf), ObservationIndex::kLeafBlocks, best_, budget_);
    if (best.floor > best_.floor) found_.lower = static_cast<std::uint32_t>(leaf);
    if (best.negated_ceiling > best_.negated_ceiling) found_.upper = static_cast<std::uint32_t>(leaf);
    best_ = best;
    --budget_.leaves;
  }

  // Every leaf that may hold a better bound, of either side. Among few leaves, few do after the first.
  void VisitLeaves(std::size_t first, std::size_t second) {
    for (std::size_t node = 0; node < index_.num_nodes(1); ++node) {
      const P floors = metric_.Node(index_.node(1, node), 0), ceilings = metric_.Node(index_.node(1, node), 1);
      for (unsigned left = ~(BitIn(node, first) | BitIn(node, second)); (left &= Better(floors, ceilings)) != 0;
           left &= left - 1) {
        budget_.capped |= budget_.leaves <= 0;
        if (budget_.leaves <= 0) return;
        Visit(node * kPackSize + ToSize(std::countr_zero(left)));
      }
    }
  }

  // The more leaves there are, the farther the best is from where the last step had it.
  void Descend() {
    Descent<Metric, 0> floors(metric_, index_, best_.floor, found_.lower);
    Descent<Metric, 1> ceilings(metric_, index_, best_.negated_ceiling, found_.upper);
    for (bool more_floors = true, more_ceilings = true; more_floors || more_ceilings;) {
      if (more_floors) more_floors = floors.Step(budget_);
      if (more_ceilings) more_ceilings = ceilings.Step(budget_);
    }
    best_ = {floors.best(), ceilings.best()};
    found_ = {floors.found(), ceilings.found()};
  }

  [[nodiscard]] static unsigned BitIn(std::size_t node, std::size_t leaf) {
    return static_cast<unsigned>(leaf / kPackSize == node) << leaf % kPackSize;
  }

  // A bit for each child whose bound exceeds the best of its side. That of a missing child does not.
  [[nodiscard]] FOREREACH_INLINE unsigned Better(const P& floors, const P& ceilings) const {
    const Lanes floor = AllLanes(best_.floor), ceiling = AllLanes(best_.negated_ceiling);
    return BitsOf((Low(floors) > floor) | (Low(ceilings) > ceiling)) |
           BitsOf((High(floors) > floor) | (High(ceilings) > ceiling)) << kLaneCount;
  }

  const Metric& metric_;
  const ObservationIndex& index_;
  FoundIn& found_;
  Budget& budget_;
  Sides best_{-kInfinity, -kInfinity};
};

}  // namespace forereach::internal

#pragma GCC diagnostic pop
