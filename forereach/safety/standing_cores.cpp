#include "forereach/safety/standing_cores.h"

#include <algorithm>
#include <cmath>

#include "forereach/numerics/size.h"

namespace forereach {

void StandingCores::Take(std::span<const Obstacle> obstacles, int dim, double added, std::size_t most) noexcept {
  dim_ = dim;
  for (const Obstacle& obstacle : obstacles.first(std::min({obstacles.size(), most, kMost}))) {
    if (obstacle.motion() || obstacle.hull().empty()) break;
    for (int k = 0; k < dim; ++k) {
      lower_[ToSize(k)][size_] = obstacle.lower()[k];
      upper_[ToSize(k)][size_] = obstacle.upper()[k];
    }
    threshold_[size_++] = AddUp(obstacle.radius(), added);
  }
  for (std::size_t o = size_; o % kLaneCount != 0; ++o) {
    for (std::size_t k = 0; k < ToSize(dim); ++k) lower_[k][o] = upper_[k][o] = 0;
    threshold_[o] = 0;
  }
}

// The operations of SeparateHulls, docs/soundness.md, 3.9, bound 1.
template <std::size_t kDim>
void StandingCores::BoundEach(std::span<const Hull> hulls, double* bounds) const noexcept {
  constexpr double kMargin = 0x1p-47;
  for (const Hull& hull : hulls)
    for (std::size_t o = 0; o < size_; o += kLaneCount, bounds += kLaneCount) {
      Lanes square = AllLanes(0);
      for (std::size_t k = 0; k < kDim; ++k) {
        const Lanes lower = LoadLanes(&lower_[k][o]), upper = LoadLanes(&upper_[k][o]);
        const Lanes center = AllLanes(hull.center[k]), half_width = AllLanes(hull.half_width[k]);
        const Lanes size = Abs(lower) + Abs(upper) + Abs(center) + half_width;
        const Lanes gap = Max(lower - center, center - upper) - half_width - AllLanes(RoundingError(kMargin, 1)) * size;
        square += gap > AllLanes(0) ? gap * gap : AllLanes(0);
      }
      const Lanes root{std::sqrt(square[0]), std::sqrt(square[1]), std::sqrt(square[2]), std::sqrt(square[3])};
      const Lanes distance = root * AllLanes(1 - kMargin), threshold = LoadLanes(&threshold_[o]);
      // Every comparison is false for NaN, and below 2^-400 the squares may have lost digits: unproven, so it is asked
      // again by directions.
      const LaneMask proven =
          (distance > AllLanes(0x1p-400)) & (distance < AllLanes(kInfinity)) & (distance > threshold);
      const Lanes clearance = distance - threshold - AllLanes(4 * kUnitRoundoff) * distance;
      StoreLanes(FirstLanes(proven ? clearance : AllLanes(-kInfinity), size_ - o, kInfinity), bounds);
    }
}

void StandingCores::BoundAll(std::span<const Hull> hulls, double* bounds) const noexcept {
  switch (dim_) {
    case 1: return BoundEach<1>(hulls, bounds);
    case 2: return BoundEach<2>(hulls, bounds);
    default: return BoundEach<3>(hulls, bounds);
  }
}

void StandingCores::Bound(std::span<const Hull> hulls, double* bounds, InstructionSet instructions) const noexcept {
  if (size_ > 0) Dispatch<&StandingCores::BoundAll>(instructions, *this, hulls, bounds);
}

}  // namespace forereach
