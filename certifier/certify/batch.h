/** Many plans against one task, on as many cores as there are. */
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "certifier/certify/certifier.h"

namespace forereach {

/** Told of each decision once, with its place in the batch and the tube it rests on, by the thread that made it:
several may be told at once. The tube is that thread's own, and used again for its next plan. Must not throw. */
using BatchListener = std::function<void(std::size_t index, const Decision& decision, const Tube& tube)>;

/** What Certifier::Certify says of each plan, in the order of the plans: every plan is decided on by itself, so the
answers do not depend on the number of threads.
@param initial_sets X_0 of each plan, or a single one for all.
@param threads at least 1; the calling thread is one of them, and no more are started than there are plans.
@throws std::invalid_argument if there are no threads, or neither one initial set nor as many as plans.
Cost: that of the calls over the cores, and for each thread a Tube, some 2 MB. @pre Certifier::Require passes for each.
*/
[[nodiscard]] std::vector<Decision> CertifyAll(const Certifier& certifier, std::span<const Plan> plans,
                                               std::span<const Zonotope> initial_sets,
                                               std::span<const Obstacle> obstacles, unsigned threads,
                                               const BatchListener& listener = {});

}  // namespace forereach
