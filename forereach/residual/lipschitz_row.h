/** Row k of the declaration as a distance between locations: d_k(z, z') = sum_l L_kl |z_l - z'_l|, over the columns l
with L_kl > 0.

For a row with one to three columns, d_k is an infinity norm in new coordinates, one for each sign pattern s with last
sign +: alpha^s = sum_l s_l L_kl z_l and d_k(z, z') = max_s |alpha^s - alpha'^s|. For more columns, d_k is a 1-norm in
the coordinates L_kl z_l. A row without columns declares a constant residual: it has no coordinates, and d_k = 0. */
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "forereach/numerics/directed.h"
#include "forereach/residual/declaration.h"

namespace forereach {

class LipschitzRow final {
 public:
  static constexpr std::size_t kMaxPatternColumns = 3;

  struct Column {
    int variable;  // index into z
    double slope;  // L_kl > 0
  };

  LipschitzRow(const Declaration& declaration, int coordinate) {
    for (int l = 0, columns = static_cast<int>(declaration.lipschitz.cols()); l < columns; ++l)
      if (const double slope = declaration.lipschitz(coordinate, l); slope > 0) columns_.push_back({l, slope});
  }

  [[nodiscard]] const std::vector<Column>& columns() const { return columns_; }
  [[nodiscard]] bool is_constant() const { return columns_.empty(); }
  [[nodiscard]] bool has_patterns() const { return !is_constant() && columns_.size() <= kMaxPatternColumns; }
  /** The number of coordinates of a location in this row: 2^(a-1) with patterns, otherwise a, for a columns. */
  [[nodiscard]] std::size_t num_coordinates() const {
    return has_patterns() ? std::size_t{1} << (columns_.size() - 1) : columns_.size();
  }

  /** Writes the num_coordinates() coordinates of the location z, whose entries are z(l), in plain arithmetic. Each
  coordinate takes at most one product for each column and a - 1 sums. */
  template <class Location>
  void Map(const Location& z, double* coordinates) const {
    if (!has_patterns()) {
      for (const Column& column : columns_) *coordinates++ = column.slope * z(column.variable);
      return;
    }
    for (std::size_t s = 0; s < num_coordinates(); ++s) {
      double sum = 0;
      for (std::size_t l = 0; l < columns_.size(); ++l) {
        const double term = columns_[l].slope * z(columns_[l].variable);
        sum = IsNegative(s, l) ? sum - term : sum + term;
      }
      coordinates[s] = sum;
    }
  }

  /** Whether sign pattern s has -1 at column l. */
  [[nodiscard]] static constexpr bool IsNegative(std::size_t s, std::size_t l) { return s >> l & 1; }

 private:
  std::vector<Column> columns_;
};

/** An upper bound on the error |computed - exact| of plain arithmetic, in any order, for an expression of sums,
products of two factors, |.|, max and min. Each leaf passes at most `roundings` roundings, the magnitudes of all leaves
add up to at most `magnitude`, and at most `products` products may underflow. Proof: each leaf is exact up to a factor
within 1 +- gamma_roundings, gamma_p = p u / (1 - p u) <= 2 p u, and |.|, max and min do not increase an error. */
[[nodiscard]] inline double PlainErrorUpper(double magnitude, int roundings, int products) noexcept {
  return AddUp(MulUp(magnitude, 2.0 * roundings * kUnitRoundoff), products * std::numeric_limits<double>::denorm_min());
}

}  // namespace forereach
