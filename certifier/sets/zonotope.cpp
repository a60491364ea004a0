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

using Columns = std::array<double, kMaxGenerators>;

// |g|_1 - |g|_inf of every column, by plain arithmetic: it only chooses what to keep. The index takes the last bits of
// the score, so that no two are equal and the earlier of equals is the larger. -1 behind the end, and for zero columns.
void Scores(const Zonotope& set, Columns& scores) {
  for (std::size_t j = 0; j < set.padded_size(); j += kLanes) {
    Lanes sum = AllLanes(0), largest = AllLanes(0);
    for (int k = 0; k < set.dim(); ++k) {
      const Lanes size = Abs(LoadLanes(&set.padded_row(k)[j]));
      sum += size;
      largest = Max(largest, size);
    }
    const auto index = static_cast<std::int64_t>(kMaxGenerators - j);
    const LaneMask bits = (std::bit_cast<LaneMask>(sum - largest) & ~LaneMask{127, 127, 127, 127}) |
                          LaneMask{index, index - 1, index - 2, index - 3};
    StoreLanes(largest > AllLanes(0) ? std::bit_cast<Lanes>(bits) : AllLanes(-1), &scores[j]);
  }
}

// How many scores lie above this one.
int Rank(const Columns& scores, std::size_t padded_size, double score) {
  LaneMask below{};
  for (std::size_t j = 0; j < padded_size; j += kLanes) below += LoadLanes(&scores[j]) > AllLanes(score);
  return -static_cast<int>(below[0] + below[1] + below[2] + below[3]);
}

// Keeps the columns of the `keep` largest scores in their order and adds the others' sizes to `boxed`.
void KeepLargest(Zonotope& set, int keep, const Columns& scores, std::span<double> boxed) {
  Columns dropped{};  // 1 or 0
  std::array<int, kMaxGenerators> source;
  int kept = 0;
  for (int j = 0; j < set.num_generators(); ++j) {
    const double score = scores[static_cast<std::size_t>(j)];
    const bool keeps = score >= 0 && Rank(scores, set.padded_size(), score) < keep;
    dropped[static_cast<std::size_t>(j)] = keeps ? 0 : 1;
    source[static_cast<std::size_t>(kept)] = j;
    kept += keeps;
  }
  for (int k = 0; k < set.dim(); ++k) {
    double* row = set.mutable_row(k);
    Lanes sum = AllLanes(0);
    for (std::size_t j = 0; j < set.padded_size(); j += kLanes) sum += Abs(LoadLanes(row + j)) * LoadLanes(&dropped[j]);
    boxed[static_cast<std::size_t>(k)] += Sum(sum);
    for (int j = 0; j < kept; ++j) row[j] = row[source[static_cast<std::size_t>(j)]];
  }
  set.Truncate(kept);
}

int CountNonzero(std::span<const double> lengths) {
  return static_cast<int>(std::ranges::count_if(lengths, [](double length) { return length != 0; }));
}

int CountZeroColumns(const Zonotope& set, const Columns& scores) {
  return static_cast<int>(std::count(scores.begin(), scores.begin() + set.num_generators(), -1.0));
}

}  // namespace

void AppendAndReduce(Zonotope& set, std::span<const double> first, std::span<const double> second, int order) noexcept {
  const int n = set.dim(), axes = CountNonzero(first) + CountNonzero(second), keep = (order - 1) * n;
  std::array<double, kMaxStates> boxed{};
  int still_kept = kMaxGenerators;  // axis-aligned generators that remain generators of their own
  if (set.num_generators() + axes > order * n) {
    Columns scores;
    Scores(set, scores);
    const int columns = set.num_generators() - CountZeroColumns(set, scores);
    const bool reduces = columns + axes > order * n;
    if (reduces) still_kept = std::max(0, keep - columns);  // their score is 0, and they come last
    const int terms = set.num_generators() + 2;
    KeepLargest(set, reduces ? keep : columns, scores, boxed);
    if (!reduces) boxed.fill(0);
    for (double& sum : boxed) sum *= 1 + (2.0 * terms) * kUnitRoundoff;
  }
  for (const std::span<const double> lengths : {first, second})
    for (std::size_t k = 0; k < lengths.size(); ++k) {
      if (lengths[k] == 0) continue;
      if (still_kept-- > 0)
        set.AppendAxis(static_cast<int>(k), lengths[k]);
      else
        boxed[k] = AddUp(boxed[k], lengths[k]);
    }
  for (int k = 0; k < n; ++k) set.AppendAxis(k, boxed[static_cast<std::size_t>(k)]);
}

}  // namespace forereach
