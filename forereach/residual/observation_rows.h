/** An append-only table of observations and their ids: what an ObservationStore knows. */
#pragma once

#include <algorithm>
#include <span>

#include "forereach/numerics/size.h"
#include "forereach/residual/growing_rows.h"
#include "forereach/residual/observations.h"

namespace forereach {

/** As Observations, one row behind the other in the order in which they came. */
class ObservationRows final {
 public:
  ObservationRows(int num_variables, int num_states)
      : num_variables_(ToSize(num_variables)),
        num_states_(ToSize(num_states)),
        rows_(num_variables_ + 2 * num_states_ + 1) {}

  [[nodiscard]] int size() const { return static_cast<int>(rows_.size()); }
  [[nodiscard]] int num_states() const { return static_cast<int>(num_states_); }
  [[nodiscard]] std::span<const double> z(int i) const { return rows_[ToSize(i)].first(num_variables_); }
  [[nodiscard]] std::span<const double> lower(int i) const {
    return rows_[ToSize(i)].subspan(num_variables_, num_states_);
  }
  [[nodiscard]] std::span<const double> upper(int i) const {
    return rows_[ToSize(i)].subspan(num_variables_ + num_states_, num_states_);
  }
  [[nodiscard]] double z(int i, int l) const { return z(i)[ToSize(l)]; }
  [[nodiscard]] double lower(int i, int k) const { return lower(i)[ToSize(k)]; }
  [[nodiscard]] double upper(int i, int k) const { return upper(i)[ToSize(k)]; }
  [[nodiscard]] int id(int i) const { return static_cast<int>(rows_[ToSize(i)].back()); }

  void Append(int id, std::span<const double> z, std::span<const double> lower, std::span<const double> upper) {
    auto to = std::ranges::copy(z, rows_.Append().begin()).out;
    to = std::ranges::copy(lower, to).out;
    *std::ranges::copy(upper, to).out = id;
  }
  /** Of another: row i. */
  void Append(const ObservationRows& other, int i) {
    std::ranges::copy(other.rows_[ToSize(i)], rows_.Append().begin());
  }
  /** As GrowingRows'. */
  void Reserve(int more) { rows_.Reserve(ToSize(more)); }
  [[nodiscard]] ObservationRows First(int count) const {
    ObservationRows first(static_cast<int>(num_variables_), num_states());
    first.rows_ = rows_.First(ToSize(count));
    return first;
  }

  /** Rows by their numbers, in that order. */
  [[nodiscard]] Observations Select(std::span<const int> indices) const {
    const auto count = std::ssize(indices);
    Observations some{Eigen::MatrixXd(count, num_variables_), Eigen::MatrixXd(count, num_states_),
                      Eigen::MatrixXd(count, num_states_)};
    const auto write = [](Eigen::MatrixXd& matrix, Eigen::Index row, std::span<const double> values) {
      matrix.row(row) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), std::ssize(values));
    };
    for (Eigen::Index row = 0; row < count; ++row) {
      const int i = indices[ToSize(row)];
      write(some.z, row, z(i)), write(some.lower, row, lower(i)), write(some.upper, row, upper(i));
    }
    return some;
  }

 private:
  std::size_t num_variables_, num_states_;
  GrowingRows rows_;  // z, lower, upper, id
};

/** The rows from `first` on, as a table of their own. */
struct LastRows {
  const ObservationRows& rows;
  int first;

  [[nodiscard]] int size() const { return rows.size() - first; }
  [[nodiscard]] int num_states() const { return rows.num_states(); }
  [[nodiscard]] double z(int i, int l) const { return rows.z(first + i, l); }
  [[nodiscard]] double lower(int i, int k) const { return rows.lower(first + i, k); }
  [[nodiscard]] double upper(int i, int k) const { return rows.upper(first + i, k); }
};

}  // namespace forereach
