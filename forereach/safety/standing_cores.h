/** Obstacles that stand and have a size, as a structure of arrays: the bound of SeparateHulls for four at a time. */
#pragma once

#include <array>
#include <span>

#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/lanes.h"
#include "forereach/safety/separation.h"

namespace forereach {

class StandingCores final {
 public:
  static constexpr std::size_t kMost = 64;

  /** Takes the first of the obstacles, at most `most` and kMost of them, up to one that moves, is a half-space or a
  grid.
  @param added is added to the radii as the threshold, metres, not negative. @pre all have the dimension `dim`. */
  void Take(std::span<const Obstacle> obstacles, int dim, double added, std::size_t most) noexcept;
  [[nodiscard]] std::size_t size() const { return size_; }

  /** For each hull, sets bounds[o] to a lower bound on SeparateHulls(hull, obstacle o, added).clearance(), within four
  units in the last place of the distance, or to -infinity unless that is proven; then infinity, up to stride(). */
  void Bound(std::span<const Hull> hulls, double* bounds, InstructionSet instructions) const noexcept;
  /** From the bounds of one hull to those of the next. */
  [[nodiscard]] std::size_t stride() const { return PaddedToLanes(size_); }

 private:
  FOREREACH_INLINE void BoundAll(std::span<const Hull> hulls, double* bounds) const noexcept;
  template <std::size_t kDim>
  FOREREACH_INLINE void BoundEach(std::span<const Hull> hulls, double* bounds) const noexcept;

  std::size_t size_ = 0;
  int dim_ = 0;
  std::array<std::array<double, kMost>, kMaxSafetyDim> lower_, upper_;  // those in use are set
  std::array<double, kMost> threshold_;
};

}  // namespace forereach
