/** What an advice_t says: how a candidate that was not certified would have to give way. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "forereach/advice_change_t.hpp"
#include "forereach/advice_t.hpp"
#include "forereach/certify/way_clear.h"

namespace forereach {

/** A candidate that `certifier` has judged, and everything that it was judged by. */
struct Abstained {
  const Certifier& certifier;
  const Plan& plan;
  const Zonotope& initial_set;
  ObstacleView obstacles;
  const Decision& verdict;
};

/** The most changes in one message. */
inline constexpr std::size_t kMaxAdviceChanges = std::extent_v<decltype(advice_t::change)>;

/** Whether there may be advice on a decision of this cause, as in decision_t. */
[[nodiscard]] constexpr bool IsAdvisedOn(std::int16_t cause) {
  return cause == static_cast<int>(Cause::kObstacle) || cause == static_cast<int>(Cause::kLimit) ||
         cause == static_cast<int>(Cause::kDomainExit);
}

/** The changes, kMaxAdviceChanges at most:
- S by obstacles: one OBSTACLE for each of the first of them that the tube may touch, in the order of the steps, each
with the least distance to give way. They are verified by certifying the candidate once more with all these obstacles
farther away.
- S by limits: one LIMIT for each limit that the tube may exceed at some sample, with the most that it may exceed it.
- D by a state or an input that leaves its range: one DOMAIN, with how far the slice reaches beyond it.
Limits and domain are not verified: that the room is there is necessary, and the plan's later steps may need more.
@param tube of the candidate; it is overwritten. @return empty for another cause, for a value that is not finite, or if
`effort` ended the search. */
[[nodiscard]] std::vector<advice_change_t> ChangesFor(const Abstained& abstained, Tube& tube,
                                                      const SearchEffort& effort);

}  // namespace forereach
