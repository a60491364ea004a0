/** Certifies many plans against one task on several cores. */
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "forereach/certify/certifier.h"

namespace forereach {

/** Called once for each decision, with its index in the batch and its tube, on the thread that made the decision.
Several threads may call it at once. The tube is valid during the call only; the thread reuses it for its next plan. It
must not throw. */
using BatchListener = std::function<void(std::size_t index, const Decision& decision, const Tube& tube)>;

/** Calls Certifier::Certify for each plan and returns the decisions in the order of the plans. The decisions do not
depend on the number of threads.
@param initial_sets X_0 of each plan, or a single one for all plans.
@param threads at least 1, including the calling thread; no more than one thread for each plan is used.
@throws std::invalid_argument if threads is 0, or the number of initial sets is neither 1 nor the number of plans.
Cost: the sum of the calls divided by the cores; each thread has a Tube of about 2.5 MB.
@pre Certifier::Require passes for each plan. */
[[nodiscard]] std::vector<Decision> CertifyAll(const Certifier& certifier, std::span<const Plan> plans,
                                               std::span<const Zonotope> initial_sets, const ObstacleView& obstacles,
                                               unsigned threads, const BatchListener& listener = {});

}  // namespace forereach
