#include "certifier/certify/batch.h"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>

namespace forereach {

std::vector<Decision> CertifyAll(const Certifier& certifier, std::span<const Plan> plans,
                                 std::span<const Zonotope> initial_sets, std::span<const Obstacle> obstacles,
                                 unsigned threads, const BatchListener& listener) {
  if (threads < 1) throw std::invalid_argument("batch: 0 threads, must be at least 1");
  const bool one_for_all = initial_sets.size() == 1;
  if (!one_for_all && initial_sets.size() != plans.size())
    throw std::invalid_argument("batch: " + std::to_string(initial_sets.size()) + " initial sets, must be 1 or " +
                                std::to_string(plans.size()));
  std::vector<Decision> decisions(plans.size());
  std::vector<Tube> tubes(std::clamp<std::size_t>(plans.size(), 1, threads));
  std::atomic<std::size_t> next = 0;
  const auto work = [&](Tube& tube) {
    for (std::size_t i = next++; i < plans.size(); i = next++) {
      decisions[i] = certifier.Certify(plans[i], initial_sets[one_for_all ? 0 : i], obstacles, tube);
      if (listener) listener(i, decisions[i], tube);
    }
  };
  {
    std::vector<std::jthread> others;  // joined at the end of this block
    for (std::size_t t = 1; t < tubes.size(); ++t) others.emplace_back([&work, &tube = tubes[t]] { work(tube); });
    work(tubes.front());
  }
  return decisions;
}

}  // namespace forereach
