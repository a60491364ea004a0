#include "forereach/sets/order_reduction.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>

#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

namespace {

// The scores |g|_1 - |g|_inf of all columns, Eq. (order-reduction), in plain arithmetic: they only choose which columns
// stay, and every choice is sound (docs/soundness.md, 3.8). The last bits of a score hold the column's index, so no two
// are equal, and of two equal values the earlier column's score is larger. Zero columns have score -1.
struct ColumnScores {
  static constexpr std::size_t kBlock = 8 * kLaneCount;

  int num_nonzero;
  // One for each column, padded with infinity to a multiple of kBlock.
  alignas(32) std::array<double, (kMaxGenerators + kBlock - 1) / kBlock * kBlock> scores;

  FOREREACH_INLINE void Compute(const Zonotope& set, std::size_t n) {
    LaneMask nonzero{}, index{kMaxGenerators, kMaxGenerators - 1, kMaxGenerators - 2, kMaxGenerators - 3};
    std::size_t j = 0;
    for (; j < set.padded_size(); j += kLaneCount, index -= LaneMask{4, 4, 4, 4}) {
      Lanes sum = AllLanes(0), largest = AllLanes(0);
      for (std::size_t k = 0; k < n; ++k) {
        const Lanes size = Abs(LoadLanes(&set.padded_row(static_cast<int>(k))[j]));
        sum += size;
        largest = Max(largest, size);
      }
      const Lanes score = Min(sum - largest, AllLanes(kMaxDouble));  // finite, so changing its bits cannot give NaN
      const LaneMask bits = (Bits(score) & ~LaneMask{127, 127, 127, 127}) | index;
      StoreLanes(largest > AllLanes(0) ? FromBits(bits) : AllLanes(-1), &scores[j]);
      nonzero -= largest > AllLanes(0);
    }
    num_nonzero = static_cast<int>((nonzero[0] + nonzero[1]) + (nonzero[2] + nonzero[3]));
    if (const std::size_t rest = ToSize(set.num_generators()) % kLaneCount; rest > 0)
      StoreLanes(FirstLanes(LoadLanes(&scores[j - kLaneCount]), rest, kInfinity), &scores[j - kLaneCount]);
    for (; j % kBlock != 0; j += kLaneCount) StoreLanes(AllLanes(kInfinity), &scores[j]);
  }
};

FOREREACH_INLINE int NumNonzero(const Zonotope& set, std::size_t n) {
  LaneMask count{};
  for (std::size_t j = 0; j < set.padded_size(); j += kLaneCount) {
    Lanes largest = Abs(LoadLanes(&set.padded_row(0)[j]));
    for (std::size_t k = 1; k < n; ++k) largest = Max(largest, Abs(LoadLanes(&set.padded_row(static_cast<int>(k))[j])));
    count -= largest > AllLanes(0);
  }
  return static_cast<int>((count[0] + count[1]) + (count[2] + count[3]));
}

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
      double* row = ArraysOf(set).mutable_row(static_cast<int>(k + i));
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

  // Leaves the first `stay`, adds the others to `boxed`, and says how many of those that stay are left to find.
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
  // Writes them into columns of zeros, those that last to the slack, and returns the column after them.
  FOREREACH_INLINE int Write(Zonotope& set, unsigned lasting, int column) const {
    for (unsigned rest = which & lasting; rest != 0; rest &= rest - 1) {
      const int k = std::countr_zero(rest);
      double& slack = ArraysOf(set).mutable_slack(k);
      slack = (slack + lengths[k]) * (1 + 4 * kUnitRoundoff);
      ArraysOf(set).mutable_axes_in_slack().Append(k);
    }
    for (unsigned rest = which & ~lasting; rest != 0; rest &= rest - 1) {
      const int k = std::countr_zero(rest);
      ArraysOf(set).mutable_row(k)[column++] = lengths[k];
    }
    return column;
  }
};

// Of the axes in the slack only the first `stay` count from now on; the others are part of the box, which stays where
// it is. Returns a bit for each axis that has one among these.
FOREREACH_INLINE unsigned BoxAxes(AxesInSlack& held, int stay, unsigned lasting) {
  unsigned boxed = 0;
  if (stay < held.count)
    for (unsigned rest = lasting; rest != 0; rest &= rest - 1)
      if (const int k = std::countr_zero(rest); held.last[ToSize(k)] > stay) boxed |= 1u << k;
  held.count = stay;
  return boxed;
}

// kDim: the set's, or 0.
template <int kDim>
FOREREACH_INLINE void AppendAndReduceLanes(Zonotope& set, const double* first, const double* second, int order,
                                           unsigned lasting) {
  const std::size_t n = ToSize(kDim > 0 ? kDim : set.dim());
  const int count = set.num_generators(), most = order * static_cast<int>(n), keep = most - static_cast<int>(n);
  AxesInSlack& held = ArraysOf(set).mutable_axes_in_slack();
  Axes early = Axes::Nonzero(first, n), late = Axes::Nonzero(second, n);
  const int axes = early.size() + late.size();
  if (count + held.count + axes <= most) {
    ArraysOf(set).Extend<kDim>(count + std::popcount(early.which & ~lasting) + std::popcount(late.which & ~lasting));
    late.Write(set, lasting, early.Write(set, lasting, count));
    return;
  }
  // Columns, axes in the slack and new ones that are not boxed.
  int left = count, stay_held = held.count, stay = axes;
  ColumnScores scores;
  if (count > keep || NumNonzero(set, n) < count) {
    scores.Compute(set, n);
    left = scores.num_nonzero;
  }
  if (left + held.count + axes > most) {
    left = std::min(keep, left);
    // The score of an axis is 0, and the new ones come last: what stays are the first of them.
    stay_held = std::min(keep - left, held.count);
    stay = std::min(keep - left - stay_held, axes);
  }
  Lengths boxed;
  for (std::size_t k = 0; k < n; k += kLaneCount) StoreLanes(AllLanes(0), &boxed[k]);
  if (stay < axes) late.Box(early.Box(stay, boxed), boxed);
  const Lanes inflation = AllLanes(1 + (2.0 * count + 8) * kUnitRoundoff);
  if (left < count)
    Drop(set, n, ToSize(count - left), scores.scores.data(), inflation, boxed);
  else
    for (std::size_t k = 0; k < n; k += kLaneCount) StoreLanes(LoadLanes(&boxed[k]) * inflation, &boxed[k]);
  const unsigned boxed_before = BoxAxes(held, stay_held, lasting);
  Axes box = Axes::Nonzero(boxed.data(), n);
  box.which |= boxed_before;
  const unsigned columns = ~lasting;
  if (left < count) ArraysOf(set).Truncate<kDim>(left);
  ArraysOf(set).Extend<kDim>(left + std::popcount(early.which & columns) + std::popcount(late.which & columns) +
                             std::popcount(box.which & columns));
  box.Write(set, lasting, late.Write(set, lasting, early.Write(set, lasting, left)));
}

}  // namespace

void AppendAndReduce(Zonotope& set, const double* first, const double* second, int order, unsigned lasting,
                     InstructionSet instructions) noexcept {
  const auto reduce = [&]<int kDim>() {
    Dispatch<&AppendAndReduceLanes<kDim>>(instructions, set, first, second, order, lasting);
  };
  switch (set.dim()) {
    case 4: return reduce.operator()<4>();
    case 6: return reduce.operator()<6>();
    default: return reduce.operator()<0>();
  }
}

}  // namespace forereach
