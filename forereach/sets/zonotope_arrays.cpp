#include "forereach/sets/zonotope_arrays.h"

#include <algorithm>

namespace forereach {

void ZonotopeArrays::AppendAxis(int k, double length) noexcept {
  if (length == 0) return;
  const int j = num_generators_;
  Extend(j + 1);
  mutable_row(k)[j] = length;
}

void ZonotopeArrays::Assign(const ZonotopeArrays& other) noexcept {
  dim_ = other.dim_;
  num_generators_ = other.num_generators_;
  axes_in_slack_ = other.axes_in_slack_;
  center_ = other.center_;
  slack_ = other.slack_;
  for (int k = 0; k < dim_; ++k) std::ranges::copy(other.padded_row(k), mutable_row(k));
}

}  // namespace forereach
