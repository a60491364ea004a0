/** An append-only table of numbers: what has been learned, a million rows perhaps. They lie in blocks that are
never moved, so growing copies nothing and leaves no holes in memory, and a snapshot shares the blocks that are full. */
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace forereach {

/** Memory: 8 width bytes a row, and a block. */
class GrowingRows final {
 public:
  explicit GrowingRows(std::size_t width) : width_(width) {}
  GrowingRows(GrowingRows&&) = default;  // for a copy, take the First
  GrowingRows& operator=(GrowingRows&&) = default;

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::span<const double> operator[](std::size_t i) const {
    return {blocks_[i / kBlock].get() + i % kBlock * width_, width_};
  }

  /** A new last row, to be written. */
  [[nodiscard]] std::span<double> Append() {
    Reserve(1);
    double* const block = blocks_[size_ / kBlock].get();
    return {block + size_++ % kBlock * width_, width_};
  }
  /** So many calls of Append then allocate nothing, and those who read earlier rows meanwhile need no lock. */
  void Reserve(std::size_t more) {
    while (blocks_.size() * kBlock < size_ + more) blocks_.push_back(NewBlock());
  }

  /** The first rows, as they stay. Who appends to this does not disturb the call. @pre count <= size(). */
  [[nodiscard]] GrowingRows First(std::size_t count) const {
    GrowingRows first(width_);
    first.size_ = count;
    first.blocks_.assign(blocks_.begin(), blocks_.begin() + static_cast<std::ptrdiff_t>(count / kBlock));
    if (const std::size_t rest = count % kBlock; rest > 0)
      std::copy_n(blocks_[count / kBlock].get(), rest * width_, first.blocks_.emplace_back(NewBlock()).get());
    return first;
  }

 private:
  static constexpr std::size_t kBlock = 256;

  [[nodiscard]] std::shared_ptr<double[]> NewBlock() const {
    return std::shared_ptr<double[]>(new double[kBlock * width_]);
  }

  std::size_t width_, size_ = 0;
  std::vector<std::shared_ptr<double[]>> blocks_;  // of two that share a block neither writes to it
};

}  // namespace forereach
