/** Candidate plans from OMPL: a progress part and a braking tail that ends at rest.

If the request allows it, the candidate is what the task's hints do, provided that this makes progress and keeps
kRoomOfHints times `clearance_step` more from the obstacles. Otherwise it is searched for.

The progress part is not a path to the goal. It has exactly `progress_steps` controls that reduce the travel distance to
the goal around the obstacles, and a braking tail fits after it. The whole nominal rollout is checked in the certifier's
discretisation, against obstacles grown by a clearance, against the domain and against the task's limits: the body, with
its parts at expressions, from sample to sample if the problem has bounds between them, and each moving obstacle at the
time of the step. The travel distance takes moving obstacles into account only if their velocity is zero. It is that of
P x; if all parts of the body stand at expressions, P x is no place among obstacles, but the joints of an arm perhaps,
and the room there is that of the body in the state with this P x and zeros.

With planner.certifies the search extends tubes from the request's X_0 (forereach/certify/extender.h): its tree holds
only what is proven so far, and a candidate is certified by the same observations but for what is asked of its end. */
#pragma once

#include <memory>

#include "planner_bridge/proposer.h"

namespace forereach {

inline constexpr int kStepsPerMs = 400;    ///< Work of a search, see MakeOmplProposer.
inline constexpr double kRoomOfHints = 8;  ///< Near obstacles searches give more plans that are certified.

/** A proposer whose Propose gives one candidate, or nothing if the search used up its work: kStepsPerMs propagated
model steps for each millisecond of options.time_limit_ms; what the hints do comes on top of it. The search counts work
instead of reading a clock, so the result depends only on request, options and obstacles. A navigation field is computed
once for each set of obstacles and clearance, in about 10 ms. Only one thread of the process may call Propose, because
OMPL's seed is global.
@throws ConfigError as RobotMotion, std::invalid_argument for an unknown algorithm, or an invalid goal or horizon. */
[[nodiscard]] std::unique_ptr<Proposer> MakeOmplProposer(const Config& config);

}  // namespace forereach
