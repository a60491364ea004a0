#include "forereach/sets/order_reduction.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>

#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

// Plain arithmetic: scores only choose which columns stay, and every choice is sound (docs/soundness.md, 3.8).
void ScoreColumns(const Zonotope& set, ColumnScores& scores) noexcept {
  ColumnScores::Writer writer(scores);
  for (std::size_t j = 0; j < set.padded_size(); j += kLaneCount) {
    Lanes sum = AllLanes(0), largest = AllLanes(0);
    for (int k = 0; k < set.dim(); ++k) {
      const Lanes size = Abs(LoadLanes(&set.padded_row(k)[j]));
      sum += size;
      largest = Max(largest, size);
    }
    writer.Add(j, sum, largest);
  }
  writer.Finish(ToSize(set.num_generators()));
}

namespace {

// Four lists of eight numbers, one in each lane.
using Lists = std::array<Lanes, 8>;

FOREREACH_INLINE void Order(Lists& x, std::size_t i, std::size_t j) {
  const Lanes low = Min(x[j], x[i]);
  x[j] = Max(x[j], x[i]);  // a separate comparison: with a shared one the compiler emits three operations
  x[i] = low;
}

// Sorts each list, by Batcher's network of 19 comparisons.
FOREREACH_INLINE void Sort(Lists& x) {
  constexpr std::uint8_t kPairs[][2] = {{0, 2}, {1, 3}, {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}, {0, 1}, {2, 3},
                                        {4, 5}, {6, 7}, {2, 4}, {3, 5}, {1, 4}, {3, 6}, {1, 2}, {3, 4}, {5, 6}};
#pragma GCC unroll 19
  for (const auto& [i, j] : kPairs) Order(x, i, j);
}

// Of each list and its partner, both sorted, the eight smallest, sorted.
FOREREACH_INLINE void MergeSmallest(Lists& x, const Lists& partner) {
  Lists smallest;
#pragma GCC unroll 8
  for (std::size_t i = 0; i < 8; ++i) smallest[i] = Min(partner[7 - i], x[i]);
  x = smallest;  // rises, then falls, in a circle
#pragma GCC unroll 3
  for (std::size_t distance = 4; distance > 0; distance /= 2)
#pragma GCC unroll 8
    for (std::size_t i = 0; i < 8; ++i)
      if ((i & distance) == 0) Order(x, i, i + distance);
}

template <int... kFrom>
FOREREACH_INLINE Lists Shuffled(const Lists& x) {
  Lists shuffled;
#pragma GCC unroll 8
  for (std::size_t i = 0; i < 8; ++i) shuffled[i] = __builtin_shufflevector(x[i], x[i], kFrom...);
  return shuffled;
}

FOREREACH_INLINE Lists SortedBlock(const double* scores) {
  Lists block;
#pragma GCC unroll 8
  for (std::size_t i = 0; i < 8; ++i) block[i] = LoadLanes(scores + i * kLaneCount);
  Sort(block);
  return block;
}

// The rank-th smallest of `count` scores, rank = 1 .. 8. Without a branch on a score: they are as good as random.
FOREREACH_INLINE double Smallest(const double* scores, std::size_t count, std::size_t rank) {
  Lists smallest = SortedBlock(scores);
  for (std::size_t first = ColumnScores::kBlock; first < count; first += ColumnScores::kBlock)
    MergeSmallest(smallest, SortedBlock(scores + first));
  MergeSmallest(smallest, Shuffled<1, 0, 3, 2>(smallest));
  MergeSmallest(smallest, Shuffled<2, 3, 0, 1>(smallest));
  return smallest[rank - 1][0];
}

[[gnu::noinline]] double SmallestOfMany(const double* scores, std::size_t count, std::size_t rank) {
  std::array<double, kMaxGenerators> sorted{};
  std::copy_n(scores, count, sorted.begin());
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(rank - 1);
  std::nth_element(sorted.begin(), at, sorted.begin() + static_cast<std::ptrdiff_t>(count));
  return *at;
}

// Lengths along the axes of the generators that become the box.
using Lengths = std::array<double, kMaxStates>;

// Moves all columns but those of a score up to `largest` to the front, in their order, in kRows rows from row k on, and
// adds the absolute values of those to `boxed`. What is behind those in front is of no meaning.
template <std::size_t kRows>
FOREREACH_INLINE void DropFromRows(Zonotope& set, std::size_t k, const double* scores, const Lanes& largest,
                                   const Lanes& inflation, Lengths& boxed) {
  Lanes sums[PaddedToLanes(kRows)] = {};
  const std::size_t size = set.padded_size();
  for (std::size_t j = 0, to = 0; j < size; j += kLaneCount) {
    const LaneMask dropped = LoadLanes(scores + j) <= largest;
    const LaneMask absolute = dropped & LaneMask{INT64_MAX, INT64_MAX, INT64_MAX, INT64_MAX};
    const unsigned bits = BitsOf(dropped);
    const Packing packing(bits);
#pragma GCC unroll 8
    for (std::size_t i = 0; i < kRows; ++i) {
      double* row = set.mutable_row(static_cast<int>(k + i));
      const Lanes four = LoadLanes(row + j);
      sums[i] += FromBits(Bits(four) & absolute);
      StoreLanes(packing(four), row + to);
    }
    to += kLaneCount - ToSize(std::popcount(bits));
  }
  for (std::size_t i = 0; i < kRows; i += kLaneCount) {
    const Lanes sum = SumEach(sums[i], sums[i + 1], sums[i + 2], sums[i + 3]);
    StoreLanes((sum + LoadLanes(&boxed[k + i])) * inflation, &boxed[k + i]);
  }
}

// Moves all columns but the `drop` of smallest score to the front and adds the absolute values of those to `boxed`.
FOREREACH_INLINE void Drop(Zonotope& set, std::size_t n, std::size_t drop, const double* scores, const Lanes& inflation,
                           Lengths& boxed) {
  constexpr std::size_t kMaxRows = 8;
  const auto count = ToSize(set.num_generators());
  const Lanes largest = AllLanes(drop <= 8 ? Smallest(scores, count, drop) : SmallestOfMany(scores, count, drop));
  std::size_t k = 0;
  for (; k + kMaxRows < n; k += kMaxRows) DropFromRows<kMaxRows>(set, k, scores, largest, inflation, boxed);
  [&]<std::size_t... I>(std::index_sequence<I...>) __attribute__((always_inline)) {
    ((n - k == I + 1 ? DropFromRows<I + 1>(set, k, scores, largest, inflation, boxed) : void()), ...);
  }
  (std::make_index_sequence<kMaxRows>());
}

// The axis-aligned generators lengths_k e_k for which bit k is set.
struct Axes {
  const double* lengths;
  unsigned which;

  FOREREACH_INLINE static Axes Nonzero(const double* lengths, std::size_t n) {
    unsigned nonzero = 0;
    for (std::size_t k = 0; k < n; k += kLaneCount) nonzero |= BitsOf(LoadLanes(lengths + k) != AllLanes(0)) << k;
    return {lengths, nonzero & ((1u << n) - 1)};
  }
  [[nodiscard]] int size() const { return std::popcount(which); }

  // Adds all but the first `stay` to `boxed`, and says how many of those that stay are left to find.
  FOREREACH_INLINE int Box(int stay, Lengths& boxed) {
    for (unsigned rest = which; rest != 0; rest &= rest - 1) {
      if (stay > 0) {
        --stay;
        continue;
      }
      const auto k = ToSize(std::countr_zero(rest));
      boxed[k] += lengths[k];
      which ^= 1u << k;
    }
    return stay;
  }
  // Writes them into columns of zeros and returns the column after them.
  FOREREACH_INLINE int Write(Zonotope& set, int column) const {
    for (unsigned rest = which; rest != 0; rest &= rest - 1) {
      const int k = std::countr_zero(rest);
      set.mutable_row(k)[column++] = lengths[k];
    }
    return column;
  }
};

// kDim: the set's, or 0.
template <int kDim>
FOREREACH_INLINE void AppendAndReduceLanes(Zonotope& set, const ColumnScores& scores, const double* first,
                                           const double* second, int order) {
  const std::size_t n = ToSize(kDim > 0 ? kDim : set.dim());
  const int count = set.num_generators(), most = order * static_cast<int>(n), keep = most - static_cast<int>(n);
  Axes early = Axes::Nonzero(first, n), late = Axes::Nonzero(second, n);
  const int axes = early.size() + late.size();
  int left = count, stay = axes;  // columns and axes that are not boxed
  if (count + axes > most) {
    left = scores.num_nonzero();
    if (left + axes > most) {
      left = std::min(keep, left);
      // The score of an axis-aligned generator is 0, and the new ones come last: what stays are the first of them.
      stay = std::min(keep - left, axes);
    }
  }
  Lengths boxed;
  if (stay == 0) {  // as most often: all of them
    for (std::size_t k = 0; k < n; k += kLaneCount)
      StoreLanes((AllLanes(0) + LoadLanes(first + k)) + LoadLanes(second + k), &boxed[k]);
    early.which = late.which = 0;
  } else {
    for (std::size_t k = 0; k < n; k += kLaneCount) StoreLanes(AllLanes(0), &boxed[k]);
    if (stay < axes) late.Box(early.Box(stay, boxed), boxed);
  }
  const Lanes inflation = AllLanes(1 + (2.0 * count + 8) * kUnitRoundoff);
  if (left < count)
    Drop(set, n, ToSize(count - left), scores.data(), inflation, boxed);
  else
    for (std::size_t k = 0; k < n; k += kLaneCount) StoreLanes(LoadLanes(&boxed[k]) * inflation, &boxed[k]);
  const Axes box = Axes::Nonzero(boxed.data(), n);
  set.Resize<kDim>(left, left + stay + box.size());
  box.Write(set, late.Write(set, early.Write(set, left)));
}

}  // namespace

void AppendAndReduce(Zonotope& set, const ColumnScores& scores, const double* first, const double* second, int order,
                     InstructionSet instructions) noexcept {
  const auto reduce = [&]<int kDim>() {
    Dispatch<&AppendAndReduceLanes<kDim>>(instructions, set, scores, first, second, order);
  };
  switch (set.dim()) {
    case 4: return reduce.operator()<4>();
    case 6: return reduce.operator()<6>();
    default: return reduce.operator()<0>();
  }
}

}  // namespace forereach
