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

/** Columns of G along axes that the slack holds instead, as lengths that add up: the same set with fewer columns. The
order reduction counts them as columns (order_reduction.h). */
struct AxesInSlack {
  int count = 0;
  /** Of the last one along each axis its place among them in the order in which they came, from 1; 0: none. */
  std::array<signed char, kMaxStates> last{};
  static_assert(kMaxGenerators <= 127);

  void Append(int k) { last[ToSize(k)] = static_cast<signed char>(++count); }
};

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
  [[nodiscard]] AxesInSlack& mutable_axes_in_slack() { return axes_in_slack_; }
  [[nodiscard]] const AxesInSlack& axes_in_slack() const { return axes_in_slack_; }

  /** Sets the sizes, and that the slack holds no axes. The caller then writes centers, slacks and rows, and keeps the
  padding of the rows zero. */
  void Reset(int dim, int num_generators) {
    axes_in_slack_ = {};
    dim_ = dim;
    num_generators_ = num_generators;
  }
  /** Keeps the first `kept` columns. What is behind them need not be zero. @tparam kDim the dimension, if it is a
  constant, here and below. */
  template <int kDim = 0>
  FOREREACH_INLINE void Truncate(int kept) noexcept {
    num_generators_ = kept;
    const std::size_t rest = ToSize(kept) % kLaneCount, j = ToSize(kept) - rest;
    if (rest == 0) return;
    for (int k = 0; k < (kDim > 0 ? kDim : dim_); ++k)
      StoreLanes(FirstLanes(LoadLanes(mutable_row(k) + j), rest, 0), mutable_row(k) + j);
  }
  /** Appends columns of zeros. */
  template <int kDim = 0>
  FOREREACH_INLINE void Extend(int num_generators) noexcept {
    std::size_t j = padded_size();
    num_generators_ = num_generators;
    for (; j < padded_size(); j += kLaneCount)
      for (int k = 0; k < (kDim > 0 ? kDim : dim_); ++k) StoreLanes(AllLanes(0), mutable_row(k) + j);
  }
  void Assign(const ZonotopeArrays& other) noexcept;
  /** Appends the generator length * e_k unless length is zero. */
  void AppendAxis(int k, double length) noexcept;

 protected:
  int dim_ = 0, num_generators_ = 0;
  AxesInSlack axes_in_slack_;
  std::array<double, kMaxStates> center_, slack_;
  alignas(32) std::array<std::array<double, kMaxGenerators>, kMaxStates> rows_;
  static_assert(kMaxGenerators % kLaneCount == 0);
};

}  // namespace forereach

FOREREACH_ARITHMETIC_END
