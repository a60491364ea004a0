/** The interface between the tube (reach/propagator.h) and a method that bounds the residual: for each coordinate,
bounds on the values of every admissible residual over a query set. */
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "forereach/numerics/interval.h"
#include "forereach/numerics/limits.h"

namespace forereach {

class Zonotope;

/** The groups of observations in which a search found its bounds. */
struct FoundIn {
  static constexpr std::uint32_t kNowhere = 0xffffffff;
  std::uint32_t lower = kNowhere, upper = kNowhere;
};

/** For every admissible residual r and every z = (x, u) in the query set, whose center is (c, u):
    lower_k <= r_k(z) - slope_k . (x - c) <= upper_k,   k = 0 .. n-1, in units of state k.
The slope is zero unless has_slope is set: the bounds are then plain intervals, and `slope` is not read. */
struct ResidualBounds {
  std::array<double, kMaxStates> lower, upper;
  bool capped;  ///< True if a limit on the work was met: sound, and perhaps wider than the observations allow.
  bool has_slope = false;
  /** Set by a search, and where the next one begins, so give it those of a query nearby. It changes the time only,
  unless the search is capped. */
  std::array<FoundIn, kMaxStates> found;
  std::array<std::array<double, kMaxStates>, kMaxStates> slope;  ///< n rows of n entries, finite.
};

/** Z_t = X_t x {u_t}, with the half-widths that the step has already computed. */
struct QuerySet {
  const Zonotope& slice;               ///< X_t
  std::span<const double> input;       ///< u_t
  std::span<const double> half_width;  ///< n upper bounds on the half-widths of the hull of X_t, slack included
};

class ResidualEnclosure {
 public:
  virtual ~ResidualEnclosure() = default;

  /** Sets lower, upper and capped. A method with slopes also sets has_slope and slope. If a lower bound exceeds its
  upper bound, no admissible residual exists. Called in every step: no heap, lock or exception.
  @pre the hull of the query lies in the certification domain, and bounds.has_slope is false. */
  virtual void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept = 0;
};

}  // namespace forereach
