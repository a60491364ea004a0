/** What a certifier has learned, in little memory: a run may learn a million transitions between two starts. */
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>

#include "forereach/residual/growing_rows.h"

namespace forereach {

/** Executed transitions in the order in which they were learned. Append-only, and none moves: the first so many of them
 * are a snapshot. Memory: 8 (d_z + n + 1) bytes for each, and a block. */
class LearnedTransitions final {
 public:
  struct Each {
    std::span<const double> z, next;  ///< (x, u) and x+
    double longer;                    ///< ExecutedTransition::longer
  };

  [[nodiscard]] std::size_t size() const { return rows_ ? rows_->size() : 0; }
  [[nodiscard]] Each operator[](std::size_t i) const {
    const std::span<const double> row = (*rows_)[i];
    return {row.first(num_variables_), row.subspan(num_variables_, row.size() - num_variables_ - 1), row.back()};
  }

  /** @pre as many numbers as the first. */
  void Add(std::span<const double> z, std::span<const double> next, double longer) {
    if (!rows_) num_variables_ = z.size(), rows_.emplace(z.size() + next.size() + 1);
    *std::ranges::copy(next, std::ranges::copy(z, rows_->Append().begin()).out).out = longer;
  }

 private:
  std::size_t num_variables_ = 0;
  std::optional<GrowingRows> rows_;
};

}  // namespace forereach
