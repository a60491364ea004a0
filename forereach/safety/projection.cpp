#include "forereach/safety/projection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

Projection::Projection(const Eigen::MatrixXd& matrix, int num_states) : dim_(static_cast<int>(matrix.rows())) {
  if (dim_ < 1 || dim_ > kMaxSafetyDim || matrix.cols() != num_states)
    throw std::invalid_argument("projection: " + std::to_string(matrix.rows()) + "-by-" +
                                std::to_string(matrix.cols()) + ", must be 1, 2 or 3 by " + std::to_string(num_states));
  if (!matrix.allFinite()) throw std::invalid_argument("projection: must be finite");
  for (int k = 0; k < dim_; ++k)
    for (int l = 0; l < num_states; ++l)
      if (matrix(k, l) != 0) entries_.push_back({k, l, Interval(matrix(k, l))});
  copies_ = (matrix.array() == 0 || matrix.array() == 1).all() && (matrix.rowwise().sum().array() == 1).all();
}

void Projection::EncloseHull(const Zonotope& slice, std::span<const double> half_width, Hull& hull) const noexcept {
  constexpr double kMargin = 0x1p-47;  // above the rounding of both sums: docs/soundness.md, 2
  hull = {};
  if (copies_) {
    for (const auto& [row, column, one] : entries_) {
      const double center = slice.center(column), reach = half_width[ToSize(column)];
      hull.center[ToSize(row)] = center;
      hull.half_width[ToSize(row)] =
          reach + (RoundingError(kMargin, std::abs(center) + reach) + std::numeric_limits<double>::min());
    }
    return;
  }
  std::array<double, kMaxSafetyDim> size{};
  for (const MatrixEntry& entry : entries_) {
    const auto k = ToSize(entry.row), l = ToSize(entry.column);
    const double weight = entry.value.lower, middle = weight * slice.center(entry.column);
    hull.center[k] += middle;
    hull.half_width[k] += std::abs(weight) * half_width[l];
    size[k] += std::abs(middle) + std::abs(weight) * half_width[l];
  }
  for (std::size_t k = 0; k < ToSize(dim_); ++k)
    hull.half_width[k] += RoundingError(kMargin, size[k]) + std::numeric_limits<double>::min();
}

void Projection::Enclose(const Zonotope& slice, std::span<const double> half_width,
                         Zonotope& projected) const noexcept {
  if (copies_) {
    ArraysOf(projected).Reset(dim_, slice.num_generators());
    for (const auto& [row, column, one] : entries_) {
      std::ranges::copy(slice.padded_row(column), ArraysOf(projected).mutable_row(row));
      ArraysOf(projected).mutable_center(row) = slice.center(column);
      ArraysOf(projected).mutable_slack(row) = slice.slack(column);
    }
  } else {
    EncloseLinearImage(entries_, slice, half_width, dim_, projected);
  }
  // Separation sums over generators and knows no slack.
  for (int k = 0; k < dim_; ++k)
    ArraysOf(projected).AppendAxis(k, std::exchange(ArraysOf(projected).mutable_slack(k), 0));
}

}  // namespace forereach
