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
  Lanes sum = AllLanes(0), nonzero = AllLanes(0);
  for (std::size_t j = 0; j < padded.size(); j += kLanes) {
    const Lanes size = Abs(LoadLanes(&padded[j]));
    sum += size;
    nonzero += size > AllLanes(0) ? AllLanes(1) : AllLanes(0);
  }
  return SumUpper(Sum(sum) + start, static_cast<int>(Sum(nonzero)) + (start != 0));
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
  const auto j = static_cast<std::size_t>(num_generators_++);
  for (int i = 0; i < dim_; ++i) {
    double* row = mutable_row(i);
    if (j % kLanes == 0) StoreLanes(AllLanes(0), row + j);
    if (i == k) row[j] = length;
  }
}

void Zonotope::Truncate(int num_generators) noexcept {
  for (int k = 0; k < dim_; ++k)
    std::fill(mutable_row(k) + num_generators, mutable_row(k) + padded_size(), 0.0);
  num_generators_ = num_generators;
}

void Zonotope::Assign(const Zonotope& other) noexcept {
  dim_ = other.dim_;
  num_generators_ = other.num_generators_;
  center_ = other.center_;
  slack_ = other.slack_;
  for (int k = 0; k < dim_; ++k) std::ranges::copy(other.padded_row(k), mutable_row(k));
}

namespace {

using ColumnMask = std::array<double, kMaxGenerators>;  // bits
constexpr std::size_t kLastLanes = kMaxGenerators - kLanes;

// By plain arithmetic: it only chooses what to keep.
FOREREACH_INLINE void ScoreAll(const Zonotope& set, ColumnScores& scores) {
  for (std::size_t j = 0; j < set.padded_size(); j += kLanes) {
    Lanes sum = AllLanes(0), largest = AllLanes(0);
    for (int k = 0; k < set.dim(); ++k) {
      const Lanes size = Abs(LoadLanes(&set.padded_row(k)[j]));
      sum += size;
      largest = Max(largest, size);
    }
    StoreLanes(ScoreColumns(sum, largest, j), &scores[j]);
  }
}

// All bits set in each column that is not among the `keep` largest scores. In groups of four times four columns, each
// compared with every column.
FOREREACH_INLINE void MarkDropped(const ColumnScores& scores, std::size_t count, int keep, ColumnMask& dropped) {
  constexpr std::size_t kGroup = 4;
  const std::int64_t limit = keep;
  const LaneMask limits{limit, limit, limit, limit};
  for (std::size_t first = 0; first < count; first += kGroup * kLanes) {
    Lanes score[kGroup];
    LaneMask larger[kGroup] = {};  // minus how many lie above
    for (std::size_t g = 0; g < kGroup; ++g) score[g] = LoadLanes(&scores[std::min(first + g * kLanes, kLastLanes)]);
    for (std::size_t i = 0; i < count; ++i) {
      const Lanes other = AllLanes(scores[i]);
      for (std::size_t g = 0; g < kGroup; ++g) larger[g] += other > score[g];
    }
    for (std::size_t g = 0; g < kGroup && first + g * kLanes < count; ++g)
      StoreLanes(std::bit_cast<Lanes>((score[g] < AllLanes(0)) | (-larger[g] >= limits)), &dropped[first + g * kLanes]);
  }
}

// Puts the columns of the `keep` largest scores and the box around the others, plus `boxed`, into the set. The box's
// columns take the places of those that were dropped.
FOREREACH_INLINE void KeepLargest(Zonotope& set, int keep, const ColumnScores& scores, double inflation, double* boxed) {
  ColumnMask dropped;
  const std::size_t padded = set.padded_size();
  MarkDropped(scores, static_cast<std::size_t>(set.num_generators()), keep, dropped);
  for (int k = 0; k < set.dim(); ++k) {
    double* row = set.mutable_row(k);
    Lanes sum = AllLanes(0);
    for (std::size_t j = 0; j < padded; j += kLanes) {
      const LaneMask mask = std::bit_cast<LaneMask>(LoadLanes(&dropped[j])), bits = std::bit_cast<LaneMask>(LoadLanes(row + j));
      sum += Abs(std::bit_cast<Lanes>(bits & mask));
      StoreLanes(std::bit_cast<Lanes>(bits & ~mask), row + j);
    }
    boxed[k] = (Sum(sum) + boxed[k]) * inflation;
  }
  int axis = 0, columns = set.num_generators();
  const auto next_axis = [&] {
    while (axis < set.dim() && boxed[axis] == 0) ++axis;
    return axis < set.dim();
  };
  for (int j = 0; j < columns; ++j) {
    if (std::bit_cast<std::int64_t>(dropped[static_cast<std::size_t>(j)]) == 0) continue;
    if (next_axis()) {
      set.mutable_row(axis)[j] = boxed[axis];
      ++axis;
    } else {  // no box left for this place: the last column comes here
      do --columns;
      while (columns > j && std::bit_cast<std::int64_t>(dropped[static_cast<std::size_t>(columns)]) != 0);
      for (int k = 0; k < set.dim() && columns > j; ++k) set.mutable_row(k)[j] = set.mutable_row(k)[columns];
    }
  }
  set.Truncate(columns);
  for (; next_axis(); ++axis) set.AppendAxis(axis, boxed[axis]);
}

FOREREACH_AVX2 void KeepLargestAvx2(Zonotope& set, int keep, const ColumnScores& scores, double inflation, double* boxed) {
  KeepLargest(set, keep, scores, inflation, boxed);
}
FOREREACH_FLATTEN void KeepLargestBaseline(Zonotope& set, int keep, const ColumnScores& scores, double inflation,
                                           double* boxed) {
  KeepLargest(set, keep, scores, inflation, boxed);
}

int CountNonzero(std::span<const double> lengths) {
  int count = 0;
  for (const double length : lengths) count += length != 0;
  return count;
}

int CountZeroColumns(const Zonotope& set, const ColumnScores& scores) {
  int count = 0;
  for (std::size_t j = 0; j < static_cast<std::size_t>(set.num_generators()); ++j) count += scores[j] < 0;
  return count;
}

}  // namespace

void AppendAndReduce(Zonotope& set, std::span<const double> first, std::span<const double> second, int order) noexcept {
  ColumnScores scores;
  ScoreAll(set, scores);
  AppendAndReduce(set, scores, first, second, order);
}

void AppendAndReduce(Zonotope& set, const ColumnScores& scores, std::span<const double> first,
                     std::span<const double> second, int order) noexcept {
  const int n = set.dim(), axes = CountNonzero(first) + CountNonzero(second), keep = (order - 1) * n;
  int columns = set.num_generators();
  if (columns + axes > order * n) columns -= CountZeroColumns(set, scores);
  const bool reduces = columns + axes > order * n;
  // Axis-aligned generators that remain generators of their own: their score is 0, and they come last.
  int still_kept = reduces ? std::max(0, keep - columns) : kMaxGenerators;
  std::array<double, kMaxStates> boxed;
  std::fill_n(boxed.begin(), n, 0.0);
  std::array<int, 2 * kMaxStates> kept_axes;
  std::array<double, 2 * kMaxStates> kept_lengths;
  std::size_t num_kept = 0;
  for (const std::span<const double> lengths : {first, second})
    for (std::size_t k = 0; k < lengths.size(); ++k) {
      if (lengths[k] == 0) continue;
      if (still_kept-- > 0) {
        kept_axes[num_kept] = static_cast<int>(k);
        kept_lengths[num_kept++] = lengths[k];
      } else {
        boxed[k] += lengths[k];
      }
    }
  if (reduces || columns < set.num_generators()) {
    const double inflation = 1 + (2.0 * set.num_generators() + 8) * kUnitRoundoff;
    const auto keep_largest = active_instruction_set == InstructionSet::kAvx2 ? KeepLargestAvx2 : KeepLargestBaseline;
    keep_largest(set, reduces ? keep : columns, scores, inflation, boxed.data());
  }
  for (std::size_t i = 0; i < num_kept; ++i) set.AppendAxis(kept_axes[i], kept_lengths[i]);
}

}  // namespace forereach
