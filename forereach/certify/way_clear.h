/** How far obstacles would have to stand away from a tube that may touch them: by how much a plan has to give way.

The tube stays as it is and the obstacle moves, so no step is computed again. A plan that passes so much farther has
another tube, which may be wider: what is found helps to plan, and proves nothing. */
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "forereach/certify/certifier.h"

namespace forereach {

/** One obstacle that the tube may touch. */
struct GivingWay {
  int obstacle;           ///< its index
  int step;               ///< the first step at which it may be touched
  Eigen::VectorXd shift;  ///< p entries, metres: moved by this, the obstacle stays clear of the tube at every step.
};

/** The work of a search. */
struct SearchEffort {
  int halvings = 8;  ///< Each distance is up to 1/2^halvings too large.
  /** Asked before each test of one obstacle along the tube. When it says false, the search ends without a result. */
  std::function<bool()> goes_on = [] { return true; };
};

/** For each obstacle that a tube may touch, moved by itself: the least shift away from the body, along an axis or, for
a half-space, along its normal. Nothing if one of them has none, or if the search was ended.
@param tube that `certifier` has made of this plan; its scratch memory is used. Cost: some dozen calls of JudgeSafety
with one obstacle, for each obstacle that is touched. */
[[nodiscard]] std::optional<std::vector<GivingWay>> FindWayClear(const Certifier& certifier, const Plan& plan,
                                                                 std::span<const Obstacle> obstacles, Tube& tube,
                                                                 const SearchEffort& effort = {});

/** The obstacle elsewhere, moving as before. @throws std::invalid_argument if it would not be finite. */
[[nodiscard]] Obstacle Shifted(const Obstacle& obstacle, const Eigen::VectorXd& by);

/** The obstacles with each of these shifts. */
[[nodiscard]] std::vector<Obstacle> Shifted(std::span<const Obstacle> obstacles, const std::vector<GivingWay>& ways);

}  // namespace forereach
