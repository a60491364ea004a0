/** Observations that came after an envelope's index was built: few, in the order in which they came, looked at one
block after the other beside the index.

One thread appends, any number read. A reader that got a size from size() may read that many entries: they were written
before the size was, and nothing is ever written to them again. */
#pragma once

#include <atomic>
#include <span>
#include <vector>

#include "certifier/numerics/lanes.h"
#include "certifier/numerics/size.h"
#include "certifier/residual/declaration.h"
#include "certifier/residual/lipschitz_envelope.h"

namespace forereach {

class EnvelopeTail final {
 public:
  static constexpr int kMaxCapacity = 1024;

  /** @pre capacity is at most kMaxCapacity. */
  EnvelopeTail(const Declaration& declaration, const LipschitzEnvelope& envelope, int capacity);

  /** How many entries may be read. */
  [[nodiscard]] int size() const { return size_.load(std::memory_order_acquire); }
  [[nodiscard]] int capacity() const { return capacity_; }

  /** Whether the envelope's error bound holds for such an observation, n entries each. */
  [[nodiscard]] bool Covers(std::span<const double> lower, std::span<const double> upper) const;

  /** @pre size() < capacity(), Covers(lower, upper), z lies in the envelope's domain. Only one thread may append. */
  void Append(std::span<const double> z, std::span<const double> lower, std::span<const double> upper);

  /** Blocks of row k, laid out as those of an ObservationIndex; the lanes behind the size are not to be read. */
  [[nodiscard]] const Pack* blocks(int k) const { return rows_[ToSize(k)].blocks.data(); }
  /** The highest floor and the highest negated ceiling of coordinate k over the first `count` entries. */
  [[nodiscard]] double HighestFloor(int k, int count) const;
  [[nodiscard]] double HighestNegatedCeiling(int k, int count) const;

 private:
  struct Row {
    std::vector<Pack> blocks;
    std::vector<double> floors, negated_ceilings;  // the highest of the first 1, 2, ... entries
  };

  const LipschitzEnvelope& envelope_;
  Eigen::VectorXd noise_bound_;
  int capacity_;
  std::vector<Row> rows_;
  std::atomic<int> size_ = 0;
};

}  // namespace forereach
