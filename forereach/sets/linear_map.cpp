#include "forereach/sets/linear_map.h"

#include <algorithm>
#include <cmath>

#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

namespace {

// Sets the generators of `image` to fl(mid(M) G) and raises error[k] by a bound on what this leaves out.
void MapGenerators(std::span<const MatrixEntry> matrix, const Zonotope& set, std::span<const double> half_widths,
                   int rows, Zonotope& image, std::span<double> error) noexcept {
  const auto m = ToSize(set.num_generators());
  ArraysOf(image).Reset(rows, set.num_generators());
  for (int k = 0; k < rows; ++k) std::fill_n(ArraysOf(image).mutable_row(k), image.padded_size(), 0.0);

  std::array<double, kMaxStates> magnitude{};  // sum_l |M_kl| r_l >= sum_j sum_l |M_kl G_lj|
  std::array<int, kMaxStates> terms{};
  std::array<bool, kMaxStates> copies{};
  for (const MatrixEntry& entry : matrix) {
    if (entry.column >= set.dim()) continue;
    const auto k = ToSize(entry.row);
    const double half_width = half_widths[ToSize(entry.column)], weight = entry.value.Middle();
    const std::span<const double> from = set.row(entry.column);
    double* to = ArraysOf(image).mutable_row(entry.row);
    for (std::size_t j = 0; j < m; ++j) to[j] += weight * from[j];

    error[k] = AddUp(error[k], MulUp(entry.value.DistanceUpper(weight), half_width));
    error[k] = AddUp(error[k], MulUp(std::abs(weight), set.slack(entry.column)));
    magnitude[k] = AddUp(magnitude[k], MulUp(std::abs(weight), half_width));
    copies[k] = terms[k]++ == 0 && std::abs(weight) == 1;
  }
  for (std::size_t k = 0; k < ToSize(rows); ++k) {
    if (copies[k] || magnitude[k] == 0) continue;  // a row that copies a coordinate is exact
    const double underflow = static_cast<double>(m) * terms[k] * std::numeric_limits<double>::denorm_min();
    error[k] = AddUp(error[k], AddUp(DotErrorUpper(magnitude[k], terms[k]), underflow));
  }
}

}  // namespace

void EncloseLinearImage(std::span<const MatrixEntry> matrix, const Zonotope& set, std::span<const double> half_widths,
                        int rows, Zonotope& image) noexcept {
  std::array<double, kMaxStates> error{};
  MapGenerators(matrix, set, half_widths, rows, image, error);

  std::array<Interval, kMaxStates> center;
  center.fill(Interval(0));
  for (const MatrixEntry& entry : matrix) center[ToSize(entry.row)] += entry.value * Interval(set.center(entry.column));
  for (int k = 0; k < rows; ++k) {
    const Interval& value = center[ToSize(k)];
    ArraysOf(image).mutable_center(k) = value.Middle();
    ArraysOf(image).mutable_slack(k) = AddUp(error[ToSize(k)], value.DistanceUpper(image.center(k)));
  }
}

}  // namespace forereach
