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

void Zonotope::AppendAxis(int k, double length) noexcept {
  if (length == 0) return;
  const auto j = static_cast<std::size_t>(num_generators_++), lane = j % kLaneCount;
  if (lane == 0)
    for (int i = 0; i < dim_; ++i) StoreLanes(AllLanes(0), mutable_row(i) + j);
  StoreLane(lane, length, mutable_row(k) + (j - lane));
}

void Zonotope::Truncate(int num_generators) noexcept {
  if (num_generators == num_generators_) return;
  for (int k = 0; k < dim_; ++k)
    std::fill(mutable_row(k) + num_generators, mutable_row(k) + padded_size(), 0.0);
  num_generators_ = num_generators;
}

void Zonotope::Close(std::array<std::uint64_t, 2> gaps) noexcept {
  std::array<std::uint8_t, kMaxGenerators> source;
  int kept = 0, in_place = 0;
  for (int j = 0; j < num_generators_; ++j) {
    source[static_cast<std::size_t>(kept)] = static_cast<std::uint8_t>(j);
    kept += static_cast<int>(~gaps[static_cast<std::size_t>(j / 64)] >> j % 64 & 1);
    in_place += kept == j + 1;
  }
  for (int k = 0; k < dim_; ++k) {
    double* row = mutable_row(k);
    for (int j = in_place; j < kept; ++j) row[j] = row[source[static_cast<std::size_t>(j)]];
  }
  Truncate(kept);
}

void Zonotope::Assign(const Zonotope& other) noexcept {
  dim_ = other.dim_;
  num_generators_ = other.num_generators_;
  center_ = other.center_;
  slack_ = other.slack_;
  for (int k = 0; k < dim_; ++k) std::ranges::copy(other.padded_row(k), mutable_row(k));
}

namespace {

constexpr std::size_t kLastLanes = kMaxGenerators - kLaneCount;

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
}

// Which columns are dropped: all bits of the doubles, and one bit of `words` each.
struct Dropped {
  std::array<double, kMaxGenerators> masks;
  std::array<std::uint64_t, 2> words{};

  FOREREACH_INLINE void Set(std::size_t first, const LaneMask& dropped) {
    StoreLanes(std::bit_cast<Lanes>(dropped), &masks[first]);
    const LaneMask bits = dropped & LaneMask{1, 2, 4, 8};
    words[first / 64] |= static_cast<std::uint64_t>((bits[0] | bits[1]) | (bits[2] | bits[3])) << first % 64;
  }
};

// Drops the columns that are not among the `keep` largest scores. In groups of four times four columns, each compared
// with every column; behind the last column nothing is dropped.
FOREREACH_INLINE void MarkDropped(const double* scores, std::size_t count, int keep, Dropped& dropped) {
  constexpr std::size_t kGroup = 4;
  const auto limit = static_cast<std::int64_t>(keep), end = static_cast<std::int64_t>(count);
  for (std::size_t first = 0; first < count; first += kGroup * kLaneCount) {
    Lanes score[kGroup];
    LaneMask larger[kGroup];  // minus how many lie above
    for (std::size_t g = 0; g < kGroup; ++g) {
      score[g] = LoadLanes(&scores[std::min(first + g * kLaneCount, kLastLanes)]);
      larger[g] = LaneMask{};
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Lanes other = AllLanes(scores[i]);
      for (std::size_t g = 0; g < kGroup; ++g) larger[g] += other > score[g];
    }
    for (std::size_t g = 0; g < kGroup && first + g * kLaneCount < count; ++g) {
      const auto j = static_cast<std::int64_t>(first + g * kLaneCount);
      const LaneMask exists = LaneMask{j, j + 1, j + 2, j + 3} < LaneMask{end, end, end, end};
      const LaneMask low = (score[g] < AllLanes(0)) | (-larger[g] >= LaneMask{limit, limit, limit, limit});
      dropped.Set(first + g * kLaneCount, low & exists);
    }
  }
}

// Leaves the columns of the `keep` largest scores, in their order, and then the box around the others, plus `boxed`.
FOREREACH_INLINE void KeepLargest(Zonotope& set, int keep, const ColumnScores& scores, double inflation, double* boxed) {
  Dropped dropped;
  const std::size_t padded = set.padded_size();
  MarkDropped(scores.data(), static_cast<std::size_t>(set.num_generators()), keep, dropped);
  for (int k = 0; k < set.dim(); ++k) {
    double* row = set.mutable_row(k);
    Lanes sum = AllLanes(0);
    for (std::size_t j = 0; j < padded; j += kLaneCount) {
      const LaneMask mask = std::bit_cast<LaneMask>(LoadLanes(&dropped.masks[j]));
      const LaneMask bits = std::bit_cast<LaneMask>(LoadLanes(row + j));
      sum += Abs(std::bit_cast<Lanes>(bits & mask));
    }
    boxed[k] = (Sum(sum) + boxed[k]) * inflation;
  }
  set.Close(dropped.words);
  for (int axis = 0; axis < set.dim(); ++axis) set.AppendAxis(axis, boxed[axis]);
}

FOREREACH_AVX2 void KeepLargestAvx2(Zonotope& set, int keep, const ColumnScores& scores, double inflation, double* boxed) {
  KeepLargest(set, keep, scores, inflation, boxed);
}
FOREREACH_FLATTEN void KeepLargestBaseline(Zonotope& set, int keep, const ColumnScores& scores, double inflation,
                                           double* boxed) {
  KeepLargest(set, keep, scores, inflation, boxed);
}

}  // namespace

void AppendAndReduce(Zonotope& set, std::span<const double> first, std::span<const double> second, int order) noexcept {
  ColumnScores scores;
  ScoreAll(set, scores);
  AppendAndReduce(set, scores, first, second, order);
}

void AppendAndReduce(Zonotope& set, const ColumnScores& scores, std::span<const double> first,
                     std::span<const double> second, int order) noexcept {
  struct Axis {
    int coordinate;
    double length;
  };
  const int n = set.dim(), keep = (order - 1) * n;
  std::array<Axis, 2 * kMaxStates> axes;
  int num_axes = 0;
  for (const std::span<const double> lengths : {first, second})
    for (int k = 0; k < static_cast<int>(lengths.size()); ++k) {
      const double length = lengths[static_cast<std::size_t>(k)];
      axes[static_cast<std::size_t>(num_axes)] = {k, length};
      num_axes += length != 0;
    }
  const bool over = set.num_generators() + num_axes > order * n;
  const int columns = over ? scores.num_nonzero() : set.num_generators();
  const bool reduces = columns + num_axes > order * n;
  // Axis-aligned generators that remain generators of their own: their score is 0, and they come last.
  const int kept_axes = reduces ? std::clamp(keep - columns, 0, num_axes) : num_axes;
  if (reduces || columns < set.num_generators()) {
    std::array<double, kMaxStates> boxed;
    std::fill_n(boxed.begin(), n, 0.0);
    for (int i = kept_axes; i < num_axes; ++i) {
      const auto& [coordinate, length] = axes[static_cast<std::size_t>(i)];
      boxed[static_cast<std::size_t>(coordinate)] += length;
    }
    const double inflation = 1 + (2.0 * set.num_generators() + 8) * kUnitRoundoff;
    const auto keep_largest = active_instruction_set == InstructionSet::kAvx2 ? KeepLargestAvx2 : KeepLargestBaseline;
    keep_largest(set, reduces ? keep : columns, scores, inflation, boxed.data());
  }
  for (int i = 0; i < kept_axes; ++i)
    set.AppendAxis(axes[static_cast<std::size_t>(i)].coordinate, axes[static_cast<std::size_t>(i)].length);
}

}  // namespace forereach
