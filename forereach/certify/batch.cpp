#include "forereach/certify/batch.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "forereach/numerics/parallel.h"

namespace forereach {

std::vector<Decision> CertifyAll(const Certifier& certifier, std::span<const Plan> plans,
                                 std::span<const Zonotope> initial_sets, const ObstacleView& obstacles,
                                 unsigned threads, const BatchListener& listener) {
  if (threads < 1) throw std::invalid_argument("batch: 0 threads, must be at least 1");
  const bool one_for_all = initial_sets.size() == 1;
  if (!one_for_all && initial_sets.size() != plans.size())
    throw std::invalid_argument("batch: " + std::to_string(initial_sets.size()) + " initial sets, must be 1 or " +
                                std::to_string(plans.size()));
  std::vector<Decision> decisions(plans.size());
  std::vector<Tube> tubes(std::clamp<std::size_t>(plans.size(), 1, threads));
  ForEachInParallel(plans.size(), threads, [&](std::size_t i, std::size_t thread) {
    Tube& tube = tubes[thread];
    decisions[i] = certifier.Certify(plans[i], initial_sets[one_for_all ? 0 : i], obstacles, tube);
    if (listener) listener(i, decisions[i], tube);
  });
  return decisions;
}

}  // namespace forereach
