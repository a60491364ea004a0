/** The arrays of a zonotope, and how the kernels of the certify step write them in place. A user of zonotopes does not
need this file.

Row k of G, which holds coordinate k of every generator, is contiguous and padded with zeros to a multiple of
kLaneCount, so a sum over generators reads four consecutive doubles at a time. These functions check nothing. */
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "forereach/numerics/lanes.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

class ZonotopeArrays {
 public:
  /** num_generators() of the zonotope rounded up to a multiple of kLaneCount. */
  [[nodiscard]] std::size_t padded_size() const { return PaddedToLanes(ToSize(num_generators_)); }
  /** The row with its padding of zeros. */
  [[nodiscard]] std::span<const double> padded_row(int k) const { return {rows_[ToSize(k)].data(), padded_size()}; }
  /** Arrays of kMaxStates entries; as many as the zonotope has dimensions are in use. */
  [[nodiscard]] const double* centers() const { return center_.data(); }
  [[nodiscard]] const double* slacks() const { return slack_.data(); }
  [[nodiscard]] double* mutable_slacks() { return slack_.data(); }
  [[nodiscard]] double* mutable_centers() { return center_.data(); }
  [[nodiscard]] double* mutable_row(int k) { return rows_[ToSize(k)].data(); }
  [[nodiscard]] double& mutable_slack(int k) { return slack_[ToSize(k)]; }
  [[nodiscard]] double& mutable_center(int k) { return center_[ToSize(k)]; }

  /** Sets the sizes. The caller then writes centers, slacks and rows, and keeps the padding of the rows zero. */
  void Reset(int dim, int num_generators) {
    dim_ = dim;
    num_generators_ = num_generators;
  }
  /** Keeps the first `kept` columns and sets the columns after them, up to `num_generators`, to zero.
  @tparam kDim the dimension, if it is a constant. */
  template <int kDim = 0>
  FOREREACH_INLINE void Resize(int kept, int num_generators) noexcept {
    const int dim = kDim > 0 ? kDim : dim_;
    num_generators_ = num_generators;
    const std::size_t rest = ToSize(kept) % kLaneCount, end = padded_size();
    std::size_t j = ToSize(kept) - rest;
    if (rest > 0) {
      for (int k = 0; k < dim; ++k) StoreLanes(FirstLanes(LoadLanes(mutable_row(k) + j), rest, 0), mutable_row(k) + j);
      j += kLaneCount;
    }
    for (; j < end; j += kLaneCount)
      for (int k = 0; k < dim; ++k) StoreLanes(AllLanes(0), mutable_row(k) + j);
  }
  /** Copies only the entries in use of another set: about 2 kB of the 15 kB of the whole value. */
  void Assign(const ZonotopeArrays& other) noexcept;
  /** Appends the generator length * e_k unless length is zero. */
  void AppendAxis(int k, double length) noexcept;

 protected:
  int dim_ = 0, num_generators_ = 0;
  std::array<double, kMaxStates> center_, slack_;
  alignas(32) std::array<std::array<double, kMaxGenerators>, kMaxStates> rows_;
  static_assert(kMaxGenerators % kLaneCount == 0);
};

}  // namespace forereach

FOREREACH_ARITHMETIC_END
