/** The executed steps of all robots as a task's transitions: for `declare --from-data` and `fit`, with what differs
between robots, and which of them contradict the task's declaration. */
#pragma once

#include "fleet/report.h"
#include "fleet/store.h"
#include "task/config.h"

namespace forereach {

enum class TransitionsBy { kRobot, kDay };

struct FleetTransitions {
  /** In the order of robot, log and event: those that a certifier of the task would learn. */
  Transitions transitions;
  double longer = 0;  ///< By how much a step lasted longer or shorter than dt by the robot's clock, at most, s.
  /** By robot or day, how many there are and each state's residual: its mean, deviation and largest size. Why others
  were refused, and where the first was. Contradictions of the declaration: pairs of transitions by which a gate answers
  F, of each robot alone; then of several, until the robots that no pair names contradict it no more. */
  FleetTable residuals, refused, contradictions;
};

/** @param task its own transitions do not count. Cost: a pass over the rows, whose numbers are kept in memory; then
a Certifier of each robot's, and one of the others' for each contradiction between robots. @throws StoreError. */
[[nodiscard]] FleetTransitions ReadTransitions(Store& store, const Config& task, const Store::WhichTransitions& which,
                                               TransitionsBy by);

}  // namespace forereach
