/** What a certifier has learned, in little memory: a run may learn a million transitions between two starts. */
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace forereach {

/** Executed transitions in the order in which they were learned. They only become more, and none moves: the first so
many of them are a snapshot. Memory: 8 (d_z + n + 1) bytes for each, and a block. */
class LearnedTransitions final {
 public:
  struct Each {
    std::span<const double> z, next;  ///< (x, u) and x+
    double longer;                    ///< ExecutedTransition::longer
  };

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] Each operator[](std::size_t i) const {
    const std::span<const double> row(blocks_[i / kBlock].get() + i % kBlock * width_, width_);
    return {row.first(num_variables_), row.subspan(num_variables_, width_ - num_variables_ - 1), row.back()};
  }

  /** @pre as many numbers as the first. */
  void Add(std::span<const double> z, std::span<const double> next, double longer) {
    if (size_ == 0) num_variables_ = z.size(), width_ = z.size() + next.size() + 1;
    if (size_ % kBlock == 0) blocks_.push_back(std::make_unique_for_overwrite<double[]>(kBlock * width_));
    double* const row = blocks_.back().get() + size_++ % kBlock * width_;
    *std::ranges::copy(next, std::ranges::copy(z, row).out).out = longer;
  }

 private:
  static constexpr std::size_t kBlock = 256;

  std::size_t num_variables_ = 0, width_ = 0, size_ = 0;
  std::vector<std::unique_ptr<double[]>> blocks_;
};

}  // namespace forereach
