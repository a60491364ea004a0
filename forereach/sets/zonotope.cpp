#include "forereach/sets/zonotope.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "forereach/numerics/text.h"

namespace forereach {
namespace {

void RequireShape(Eigen::Index center, Eigen::Index rows, Eigen::Index columns) {
  if (center != rows || center > kMaxStates || columns > kMaxGenerators)
    throw std::invalid_argument("zonotope: a center of " + std::to_string(center) + " entries and " +
                                std::to_string(rows) + "-by-" + std::to_string(columns) + " generators; at most " +
                                std::to_string(kMaxStates) + " rows and " + std::to_string(kMaxGenerators) +
                                " columns");
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
    mutable_slack(k) = 0;
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
    const double d = direction[ToSize(k)];
    if (d == 0) continue;
    value += Interval(d) * Interval(center(k));
    magnitude = AddUp(magnitude, MulUp(std::abs(d), HalfWidthUpper(k)));
    slack_along = AddUp(slack_along, MulUp(std::abs(d), slack(k)));
    const std::span<const double> entries = row(k);
    for (std::size_t j = 0; j < entries.size(); ++j) along[j] += d * entries[j];
  }
  const double spread = AbsoluteSumUpper({along.data(), padded_size()}, 0);
  // The rounding errors of all |d . g_j| add up to at most the bound by the magnitude.
  const double underflow = num_generators_ * dim_ * std::numeric_limits<double>::denorm_min();
  const double error = AddUp(DotErrorUpper(magnitude, dim_), underflow);
  return AddUp(value.upper, AddUp(AddUp(spread, slack_along), error));
}

}  // namespace forereach
