/** Observations that arrived after an envelope's index was built, in their order of arrival. A query scans all of them
beside the index.

One thread appends; any number of threads read. A reader may read as many entries as size() returned to it: each entry
is complete before size() counts it and never changes afterwards. */
#pragma once

#include <atomic>
#include <span>
#include <vector>

#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/declaration.h"
#include "forereach/residual/lipschitz_envelope.h"

namespace forereach {

class EnvelopeTail final {
 public:
  static constexpr int kMaxCapacity = 1024;

  /** @param envelope must outlive this object. @pre 0 <= capacity <= kMaxCapacity. Allocates all memory. */
  EnvelopeTail(const Declaration& declaration, const LipschitzEnvelope& envelope, int capacity);

  /** The number of entries that may be read. */
  [[nodiscard]] int size() const { return size_.load(std::memory_order_acquire); }
  [[nodiscard]] int capacity() const { return capacity_; }

  /** Whether the envelope's error bounds E_k hold for an observation with these enclosures of its residual, n entries
  each: |lower_k| + eps_k and |upper_k| + eps_k, eps_k = Declaration::ObservationError, are at most the envelope's
  value_limit(k). */
  [[nodiscard]] bool Covers(std::span<const double> lower, std::span<const double> upper) const;

  /** Adds an observation at z. Only one thread may call this. No allocation.
  @pre size() < capacity(), Covers(lower, upper), and z lies in the envelope's domain. */
  void Append(std::span<const double> z, std::span<const double> lower, std::span<const double> upper);

  /** The blocks of row k, laid out as those of an ObservationIndex. Do not read lanes behind the last entry. */
  [[nodiscard]] const Pack* blocks(int k) const { return rows_[ToSize(k)].blocks.data(); }
  /** The highest floor and the highest negated ceiling of coordinate k over the first `count` entries. */
  [[nodiscard]] double HighestFloor(int k, int count) const;
  [[nodiscard]] double HighestNegatedCeiling(int k, int count) const;

 private:
  struct Row {
    double observation_error;
    std::vector<Pack> blocks;
    std::vector<double> floors, negated_ceilings;  // the highest of the first 1, 2, ... entries
  };

  const LipschitzEnvelope& envelope_;
  int capacity_;
  std::vector<Row> rows_;
  std::atomic<int> size_ = 0;
};

}  // namespace forereach
