/** Certifies many plans against one task on several cores. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

/** Called once for each decision, with its index in the batch and its tube, on the thread that made the decision.
Several threads may call it at once. The tube is valid during the call only; the thread reuses it for its next plan. It
must not throw. */
using BatchListener = std::function<void(std::size_t index, const Decision& decision, const Tube& tube)>;

/** Which plans of a batch are judged, and by how many threads. */
struct BatchOptions {
  unsigned threads = 1;  ///< At least 1, including the calling thread; no more than one for each plan is used.
  /** True: the plans after the first certified one are not judged. */
  bool until_certified = false;
  /** No plan is begun once `clock` gives `deadline` or later; without a clock, each is. Several threads may call it at
  once. It must not throw. */
  std::function<std::int64_t()> clock = {};
  std::int64_t deadline = 0;
  std::span<Tube> tubes = {};  ///< Memory for the tubes, one for each thread; none: tubes are made anew.
};

/** Calls Certifier::Certify for each plan and returns the decisions in the order of the plans. Outcome kNone: the plan
was not judged. Without a deadline the decisions do not depend on the number of threads.

Plans are begun in their order, but those that begin with the same controls follow one another. If all begin in one X_0,
a thread does not propagate again what a plan shares with the one before it; decisions and tubes are the same bits.
@param initial_sets X_0 of each plan, or a single one for all plans.
@throws std::invalid_argument if there are 0 threads, tubes but fewer than threads, or the number of initial sets is
neither 1 nor the number of plans.
Cost: the sum of the calls, less what is shared, divided by the cores. Each thread has a Tube of about 2.5 MB, which
takes some 0.5 ms to be made. Nothing is allocated for a step.
@pre Certifier::Require passes for each plan. */
[[nodiscard]] std::vector<Decision> CertifyAll(const Certifier& certifier, std::span<const Plan> plans,
                                               std::span<const Zonotope> initial_sets, const ObstacleView& obstacles,
                                               const BatchOptions& options = {}, const BatchListener& listener = {});

}  // namespace forereach
