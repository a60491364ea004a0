/** A brake that needs no plan: in each step it takes every state that it acts on towards zero by that state's decline,

    x_k -> sign(x_k) max(0, |x_k| - decline_k),

while the other states move on. It is the emergency stop of a task (robot.emergency_stop). The simulated robot brakes
exactly like this; a robot with a brake that is at least as strong may link it for its bound on the steps. */
#pragma once

#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "forereach/numerics/compilation.h"

namespace forereach {

class Brake final {
 public:
  static constexpr int kMostSteps = 10'000;  ///< A longer stop counts as one without a known end.
  static constexpr int kNoEnd = std::numeric_limits<int>::max();

  Brake() = default;  ///< Acts on no state.
  /** @param declines one entry for each state, in its unit per step: 0: the brake does not act on it; infinity: it is
  zero at once. @throws std::invalid_argument for a negative number or NaN. */
  explicit Brake(std::vector<double> declines);

  /** An upper bound on the number of steps after which all states that it acts on are zero, from any x with lower <= x
  <= upper; kNoEnd if it is above kMostSteps or a number is NaN. 0: it has nothing to do. Cost O(states), no allocation.
  @param lower, upper as many entries as there are declines. */
  [[nodiscard]] int StepsToRest(std::span<const double> lower, std::span<const double> upper) const noexcept;

  /** Sets the states that it acts on to those after `share` of a step, 0 to 1, from `before`; the others keep their
  value. What is below 1e-9 of its decline is zero, so that rounding costs no step.
  @param before, x as many entries as there are declines; they may be the same. */
  void Apply(std::span<const double> before, double share, std::span<double> x) const noexcept;

 private:
  std::vector<double> declines_;
};

}  // namespace forereach
