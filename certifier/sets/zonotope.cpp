#include "certifier/sets/zonotope.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "certifier/numerics/text.h"

namespace forereach {
namespace {

void RequireShape(Eigen::Index center, Eigen::Index rows, Eigen::Index columns) {
  if (center != rows || center > kMaxStates || columns > kMaxGenerators)
    throw std::invalid_argument("zonotope: a center of " + std::to_string(center) + " entries and " +
                                std::to_string(rows) + "-by-" + std::to_string(columns) +
                                " generators; at most " + std::to_string(kMaxStates) + " rows and " +
                                std::to_string(kMaxGenerators) + " columns");
}

// An upper bound on start + sum |g| of a padded row. Zeros add no rounding error, so a single entry is summed exactly.
double AbsoluteSumUpper(std::span<const double> padded, double start) {
  Lanes sum = AllLanes(0);
  LaneMask nonzero{};
  for (std::size_t j = 0; j < padded.size(); j += kLaneCount) {
    const Lanes size = Abs(LoadLanes(&padded[j]));
    sum += size;
    nonzero -= size > AllLanes(0);
  }
  const auto terms = static_cast<int>((nonzero[0] + nonzero[1]) + (nonzero[2] + nonzero[3])) + (start != 0);
  return SumUpper(Sum(sum) + start, terms);
}

}  // namespace

Zonotope::Zonotope(const Eigen::VectorXd& center, const Eigen::MatrixXd& generators) {
  RequireShape(center.size(), generators.rows(), generators.cols());
  if (!center.allFinite() || !generators.allFinite())
    throw std::invalid_argument("zonotope: center and generators must be finite");
  Reset(static_cast<int>(center.size()), static_cast<int>(generators.cols()));
  for (int k = 0; k < dim_; ++k) {
    mutable_center(k) = center[k];
    std::fill_n(mutable_row(k), padded_size(), 0.0);
    for (int j = 0; j < num_generators_; ++j) mutable_row(k)[j] = generators(k, j);
  }
}

Zonotope Zonotope::FromBox(const Eigen::VectorXd& center, const Eigen::VectorXd& half_width) {
  RequireShape(center.size(), half_width.size(), half_width.size());
  Zonotope box(center, Eigen::MatrixXd(center.size(), 0));
  for (int k = 0; k < box.dim_; ++k) {
    if (!(half_width[k] >= 0 && half_width[k] < kInfinity))
      throw std::invalid_argument("zonotope: half_width " + std::to_string(k) + " is " + ToText(half_width[k]) +
                                  ", must be finite and not negative");
    box.AppendAxis(k, half_width[k]);
  }
  return box;
}

Zonotope Zonotope::Enclose(const Box& box) {
  Eigen::VectorXd center(box.dim()), half_width(box.dim());
  for (int k = 0; k < box.dim(); ++k) {
    const Interval side(box.lower()[k], box.upper()[k]);
    center[k] = side.Middle();
    half_width[k] = side.DistanceUpper(center[k]);
  }
  return FromBox(center, half_width);
}

Eigen::VectorXd Zonotope::CenterVector() const { return Eigen::Map<const Eigen::VectorXd>(center_.data(), dim_); }

Eigen::MatrixXd Zonotope::GeneratorMatrix() const {
  Eigen::MatrixXd generators = Eigen::MatrixXd::Zero(dim_, num_generators_ + dim_);
  int columns = num_generators_;
  for (int k = 0; k < dim_; ++k) {
    generators.row(k).head(num_generators_) = Eigen::Map<const Eigen::RowVectorXd>(row(k).data(), num_generators_);
    if (slack(k) != 0) generators(k, columns++) = slack(k);
  }
  return generators.leftCols(columns);
}

double Zonotope::HalfWidthUpper(int k) const noexcept { return AbsoluteSumUpper(padded_row(k), slack(k)); }

Interval Zonotope::Hull(int k) const noexcept {
  const double half_width = HalfWidthUpper(k);
  return {SubDown(center(k), half_width), AddUp(center(k), half_width)};
}

double Zonotope::SupportUpper(std::span<const double> direction) const noexcept {
  Interval value(0);
  double magnitude = 0, slack_along = 0;
  alignas(32) std::array<double, kMaxGenerators> along{};
  for (int k = 0; k < dim_; ++k) {
    const double d = direction[static_cast<std::size_t>(k)];
    if (d == 0) continue;
    value += Interval(d) * Interval(center(k));
    magnitude = AddUp(magnitude, MulUp(std::abs(d), HalfWidthUpper(k)));
    slack_along = AddUp(slack_along, MulUp(std::abs(d), slack(k)));
    const std::span<const double> entries = row(k);
    for (std::size_t j = 0; j < entries.size(); ++j) along[j] += d * entries[j];
  }
  const double spread = AbsoluteSumUpper({along.data(), padded_size()}, 0);
  // Every |d . g_j| is off by a rounding error whose sum over j the magnitude bounds.
  const double underflow = num_generators_ * dim_ * std::numeric_limits<double>::denorm_min();
  const double error = AddUp(DotErrorUpper(magnitude, dim_), underflow);
  return AddUp(value.upper, AddUp(AddUp(spread, slack_along), error));
}

void Zonotope::Resize(int kept, int num_generators) noexcept {
  num_generators_ = num_generators;
  const std::size_t rest = static_cast<std::size_t>(kept) % kLaneCount, end = padded_size();
  for (int k = 0; k < dim_; ++k) {
    double* row = mutable_row(k);
    std::size_t j = static_cast<std::size_t>(kept) - rest;
    if (rest > 0) StoreLanes(FirstLanes(LoadLanes(row + j), rest, 0), row + j), j += kLaneCount;
    for (; j < end; j += kLaneCount) StoreLanes(AllLanes(0), row + j);
  }
}

void Zonotope::AppendAxis(int k, double length) noexcept {
  if (length == 0) return;
  const int j = num_generators_;
  Resize(j, j + 1);
  mutable_row(k)[j] = length;
}

void Zonotope::Assign(const Zonotope& other) noexcept {
  dim_ = other.dim_;
  num_generators_ = other.num_generators_;
  center_ = other.center_;
  slack_ = other.slack_;
  for (int k = 0; k < dim_; ++k) std::ranges::copy(other.padded_row(k), mutable_row(k));
}

namespace {

// By plain arithmetic: it only chooses what to keep.
FOREREACH_INLINE void ScoreAll(const Zonotope& set, ColumnScores& scores) {
  for (std::size_t j = 0; j < set.padded_size(); j += kLaneCount) {
    Lanes sum = AllLanes(0), largest = AllLanes(0);
    for (int k = 0; k < set.dim(); ++k) {
      const Lanes size = Abs(LoadLanes(&set.padded_row(k)[j]));
      sum += size;
      largest = Max(largest, size);
    }
    scores.Set(j, sum, largest);
  }
  scores.Finish(static_cast<std::size_t>(set.num_generators()));
}

// Four lists of eight numbers, one in each lane.
using Lists = std::array<Lanes, 8>;

FOREREACH_INLINE void Order(Lists& x, std::size_t i, std::size_t j) {
  const Lanes low = Min(x[j], x[i]);
  x[j] = Max(x[i], x[j]);
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

FOREREACH_INLINE Lists Shuffled(const Lists& x, const LaneMask& from) {
  Lists shuffled;
#pragma GCC unroll 8
  for (std::size_t i = 0; i < 8; ++i) shuffled[i] = __builtin_shuffle(x[i], from);
  return shuffled;
}

// The rank-th smallest of `count` scores, rank = 1 .. 8. Without a branch on a score: they are as good as random.
FOREREACH_INLINE double Smallest(const double* scores, std::size_t count, std::size_t rank) {
  Lists smallest;
  smallest.fill(AllLanes(kInfinity));
  for (std::size_t first = 0; first < count; first += 8 * kLaneCount) {
    Lists next;
#pragma GCC unroll 8
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t j = first + i * kLaneCount;
      next[i] = j < count ? LoadLanes(&scores[j]) : AllLanes(kInfinity);
    }
    Sort(next);
    if (first > 0)
      MergeSmallest(smallest, next);
    else
      smallest = next;
  }
  MergeSmallest(smallest, Shuffled(smallest, LaneMask{1, 0, 3, 2}));
  MergeSmallest(smallest, Shuffled(smallest, LaneMask{2, 3, 0, 1}));
  return smallest[rank - 1][0];
}

double SmallestOfMany(const double* scores, std::size_t count, std::size_t rank) {
  std::array<double, kMaxGenerators> sorted;
  std::copy_n(scores, count, sorted.begin());
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(rank - 1);
  std::nth_element(sorted.begin(), at, sorted.begin() + static_cast<std::ptrdiff_t>(count));
  return *at;
}

// Moves all columns but the `drop` of smallest score to the front, in their order, and adds the absolute values of those
// to `boxed`. What is behind those in front is of no meaning.
FOREREACH_INLINE void Drop(Zonotope& set, std::size_t drop, const ColumnScores& scores, double inflation, double* boxed) {
  // Which of four columns are dropped: all bits of their absolute values, and one bit each; how many are left.
  struct Dropped {
    LaneMask absolute;
    unsigned bits;
    std::ptrdiff_t left;
  };
  std::array<Dropped, kMaxGenerators / kLaneCount> dropped;
  const auto count = static_cast<std::size_t>(set.num_generators());
  const double largest = drop <= 8 ? Smallest(scores.data(), count, drop) : SmallestOfMany(scores.data(), count, drop);
  const std::size_t chunks = set.padded_size() / kLaneCount;
  for (std::size_t c = 0; c < chunks; ++c) {
    const LaneMask mask = LoadLanes(scores.data() + c * kLaneCount) <= AllLanes(largest);
    const unsigned bits = BitsOf(mask);
    dropped[c] = {mask & LaneMask{INT64_MAX, INT64_MAX, INT64_MAX, INT64_MAX}, bits, static_cast<std::ptrdiff_t>(kLaneCount) - std::popcount(bits)};
  }
  std::size_t first = 0;
  while (dropped[first].bits == 0) ++first;
  for (int k = 0; k < set.dim(); ++k) {
    double* row = set.mutable_row(k);
    double* to = row + first * kLaneCount;
    Lanes sum = AllLanes(0);
    for (std::size_t c = first; c < chunks; ++c) {
      const Lanes four = LoadLanes(row + c * kLaneCount);
      sum += std::bit_cast<Lanes>(std::bit_cast<LaneMask>(four) & dropped[c].absolute);
      StoreLanes(PackLanes(four, dropped[c].bits), to);
      to += dropped[c].left;
    }
    boxed[k] = (Sum(sum) + boxed[k]) * inflation;
  }
}

FOREREACH_AVX2 void DropAvx2(Zonotope& set, std::size_t drop, const ColumnScores& scores, double inflation, double* boxed) {
  Drop(set, drop, scores, inflation, boxed);
}
FOREREACH_FLATTEN void DropBaseline(Zonotope& set, std::size_t drop, const ColumnScores& scores, double inflation,
                                    double* boxed) {
  Drop(set, drop, scores, inflation, boxed);
}

// Axis-aligned generators.
class Axes {
 public:
  /** Appends lengths_k e_k, those that are not zero. */
  void Append(std::span<const double> lengths) {
    std::size_t size = size_;
    for (std::size_t k = 0; k < lengths.size(); ++k) {
      list_[size] = {k, lengths[k]};
      size += lengths[k] != 0;
    }
    size_ = size;
  }
  /** Forgets all but the first `kept` and adds their lengths up. */
  void Take(int kept, double* lengths) {
    const auto first = static_cast<std::size_t>(kept);
    for (std::size_t i = first; i < size_; ++i) lengths[list_[i].coordinate] += list_[i].length;
    size_ = first;
  }
  [[nodiscard]] int size() const { return static_cast<int>(size_); }
  /** Leaves the first columns of the set and writes these behind them. */
  void Write(Zonotope& set, int columns) const {
    set.Resize(columns, columns + size());
    for (std::size_t i = 0; i < size_; ++i) set.mutable_row(static_cast<int>(list_[i].coordinate))[columns++] = list_[i].length;
  }

 private:
  struct Axis {
    std::size_t coordinate;
    double length;
  };
  std::size_t size_ = 0;
  std::array<Axis, 3 * kMaxStates + 1> list_;  // one more is written, and stays if its length is not zero
};

}  // namespace

void AppendAndReduce(Zonotope& set, std::span<const double> first, std::span<const double> second, int order) noexcept {
  ColumnScores scores;
  ScoreAll(set, scores);
  AppendAndReduce(set, scores, first, second, order);
}

void AppendAndReduce(Zonotope& set, const ColumnScores& scores, std::span<const double> first,
                     std::span<const double> second, int order) noexcept {
  const int n = set.dim(), keep = (order - 1) * n, count = set.num_generators();
  Axes axes;
  axes.Append(first);
  axes.Append(second);
  if (count + axes.size() <= order * n) return axes.Write(set, count);
  const int nonzero = scores.num_nonzero();
  const bool reduces = nonzero + axes.size() > order * n;
  const int left = reduces ? std::min(keep, nonzero) : nonzero;
  std::array<double, kMaxStates> boxed;
  std::fill_n(boxed.begin(), n, 0.0);
  // The score of an axis-aligned generator is 0, and the new ones come last: what is left are the first of them.
  if (reduces) axes.Take(std::min(keep - left, axes.size()), boxed.data());
  const double inflation = 1 + (2.0 * count + 8) * kUnitRoundoff;
  const auto drop = active_instruction_set == InstructionSet::kAvx2 ? DropAvx2 : DropBaseline;
  if (left < count)
    drop(set, static_cast<std::size_t>(count - left), scores, inflation, boxed.data());
  else
    for (int k = 0; k < n; ++k) boxed[static_cast<std::size_t>(k)] *= inflation;
  axes.Append({boxed.data(), static_cast<std::size_t>(n)});
  axes.Write(set, left);
}

}  // namespace forereach
