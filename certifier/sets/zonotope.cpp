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

// An upper bound on start + sum |g|. Zeros add no rounding error, so a single entry is summed exactly.
double AbsoluteSumUpper(std::span<const double> row, double start = 0) {
  double sum = start;
  int terms = start != 0;
  for (const double g : row) {
    sum += std::abs(g);
    terms += g != 0;
  }
  return SumUpper(sum, terms);
}

}  // namespace

Zonotope::Zonotope(const Eigen::VectorXd& center, const Eigen::MatrixXd& generators) {
  RequireShape(center.size(), generators.rows(), generators.cols());
  if (!center.allFinite() || !generators.allFinite())
    throw std::invalid_argument("zonotope: center and generators must be finite");
  Reset(static_cast<int>(center.size()), static_cast<int>(generators.cols()));
  for (int k = 0; k < dim_; ++k) {
    mutable_center(k) = center[k];
    for (int j = 0; j < num_generators_; ++j) mutable_row(k)[static_cast<std::size_t>(j)] = generators(k, j);
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

double Zonotope::HalfWidthUpper(int k) const noexcept { return AbsoluteSumUpper(row(k), slack(k)); }

Interval Zonotope::Hull(int k) const noexcept {
  const double half_width = HalfWidthUpper(k);
  return {SubDown(center(k), half_width), AddUp(center(k), half_width)};
}

double Zonotope::SupportUpper(std::span<const double> direction) const noexcept {
  Interval value(0);
  double magnitude = 0, slack_along = 0;
  std::array<double, kMaxGenerators> along{};
  for (int k = 0; k < dim_; ++k) {
    const double d = direction[static_cast<std::size_t>(k)];
    if (d == 0) continue;
    value += Interval(d) * Interval(center(k));
    magnitude = AddUp(magnitude, MulUp(std::abs(d), HalfWidthUpper(k)));
    slack_along = AddUp(slack_along, MulUp(std::abs(d), slack(k)));
    const std::span<const double> entries = row(k);
    for (std::size_t j = 0; j < entries.size(); ++j) along[j] += d * entries[j];
  }
  const double spread = AbsoluteSumUpper({along.data(), static_cast<std::size_t>(num_generators_)});
  // Every |d . g_j| is off by a rounding error whose sum over j the magnitude bounds.
  const double underflow = num_generators_ * dim_ * std::numeric_limits<double>::denorm_min();
  const double error = AddUp(DotErrorUpper(magnitude, dim_), underflow);
  return AddUp(value.upper, AddUp(AddUp(spread, slack_along), error));
}

void Zonotope::AppendAxis(int k, double length) noexcept {
  if (length == 0) return;
  const auto j = static_cast<std::size_t>(num_generators_++);
  for (int i = 0; i < dim_; ++i) rows_[static_cast<std::size_t>(i)][j] = i == k ? length : 0;
}

namespace {

// |g|_1 - |g|_inf of every column, by plain arithmetic: it only chooses what to keep.
void Scores(const Zonotope& set, std::span<double> scores) {
  std::array<double, kMaxGenerators> largest{};
  std::fill(scores.begin(), scores.end(), 0.0);
  for (int k = 0; k < set.dim(); ++k) {
    const std::span<const double> row = set.row(k);
    for (std::size_t j = 0; j < row.size(); ++j) {
      const double size = std::abs(row[j]);
      scores[j] += size;
      largest[j] = std::max(largest[j], size);
    }
  }
  for (std::size_t j = 0; j < scores.size(); ++j) scores[j] -= largest[j];
}

}  // namespace

void ReduceOrder(Zonotope& set, int order) noexcept {
  const int n = set.dim(), m = set.num_generators();
  if (m <= order * n) return;
  std::array<double, kMaxGenerators> scores;
  Scores(set, {scores.data(), static_cast<std::size_t>(m)});

  std::array<int, kMaxGenerators> columns;
  std::iota(columns.begin(), columns.begin() + m, 0);
  const auto kept_end = columns.begin() + (order - 1) * n;
  std::nth_element(columns.begin(), kept_end, columns.begin() + m, [&](int a, int b) {
    const double score_a = scores[static_cast<std::size_t>(a)], score_b = scores[static_cast<std::size_t>(b)];
    return score_a > score_b || (score_a == score_b && a < b);
  });
  std::sort(columns.begin(), kept_end);

  std::array<double, kMaxStates> boxed;
  for (int k = 0; k < n; ++k) {
    const std::span<double> row = set.mutable_row(k);
    double sum = 0;
    for (auto column = kept_end; column != columns.begin() + m; ++column)
      sum += std::abs(row[static_cast<std::size_t>(*column)]);
    boxed[static_cast<std::size_t>(k)] = SumUpper(sum, m);
    std::size_t j = 0;
    for (auto column = columns.begin(); column != kept_end; ++column) row[j++] = row[static_cast<std::size_t>(*column)];
  }
  set.SetNumGenerators((order - 1) * n);
  for (int k = 0; k < n; ++k) set.AppendAxis(k, boxed[static_cast<std::size_t>(k)]);
}

}  // namespace forereach
