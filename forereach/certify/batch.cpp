#include "forereach/certify/batch.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "forereach/numerics/parallel.h"

namespace forereach {
namespace {

using Index = std::size_t;

// Of what two plans do at step t, by bits: 0 if it is the same. Having ended comes first.
int CompareStep(const Plan& a, const Plan& b, int t) {
  if (t >= a.num_steps || t >= b.num_steps) return (t < a.num_steps ? 1 : 0) - (t < b.num_steps ? 1 : 0);
  return std::memcmp(a.input(t).data(), b.input(t).data(), a.input(t).size_bytes());
}

int SharedSteps(const Plan& a, const Plan& b) {
  const int steps = std::min(a.num_steps, b.num_steps);
  int t = 0;
  while (t < steps && CompareStep(a, b, t) == 0) ++t;
  return t;
}

// Puts plans one after the other that begin with the same controls. All else stays in order, that is ascending: groups
// by their first members, and plans in their group.
class Gatherer {
 public:
  explicit Gatherer(std::span<const Plan> plans) : plans_(plans), sorted_(plans.size()), first_(plans.size()) {}

  // @param order plans that are the same before step t.
  void Gather(std::span<Index> order, int t) {
    if (order.size() <= 2) return;  // they are neighbours
    const auto differs = [&](Index i) { return CompareStep(plans_[order[0]], plans_[i], t) != 0; };
    for (; std::ranges::none_of(order, differs); ++t)
      if (t >= plans_[order[0]].num_steps) return;
    if (!FindFirsts(order, t)) return;
    std::ranges::sort(order, {}, [&](Index i) { return std::tuple(first_[i], i); });
    for (Index begin = 0, end = 0; begin < order.size(); begin = end) {
      const Index leader = order[begin];  // what is below changes first_ of this group alone
      while (end < order.size() && first_[order[end]] == leader) ++end;
      if (t < plans_[leader].num_steps) Gather(order.subspan(begin, end - begin), t + 1);
    }
  }

 private:
  // Of each plan the first one with the same step t. False: they are all different.
  bool FindFirsts(std::span<const Index> order, int t) {
    const std::span sorted = std::span(sorted_).first(order.size());
    std::ranges::copy(order, sorted.begin());
    std::ranges::sort(sorted, [&](Index i, Index j) {
      const int compared = CompareStep(plans_[i], plans_[j], t);
      return compared != 0 ? compared < 0 : i < j;
    });
    bool any = false;
    for (Index k = 0; k < sorted.size(); ++k) {
      const bool joins = k > 0 && CompareStep(plans_[sorted[k - 1]], plans_[sorted[k]], t) == 0;
      first_[sorted[k]] = joins ? first_[sorted[k - 1]] : sorted[k];
      any |= joins;
    }
    return any;
  }

  std::span<const Plan> plans_;
  std::vector<Index> sorted_, first_;
};

// The plans in the order in which they are begun.
std::vector<Index> Gathered(std::span<const Plan> plans, bool shares) {
  std::vector<Index> order(plans.size());
  std::iota(order.begin(), order.end(), Index{0});
  if (shares) Gatherer(plans).Gather(order, 0);
  return order;
}

// So many plans that share controls are one thread's at most, so that none waits long for another.
constexpr Index kMostTogether = 8;

// Where each thread's next plans begin, and the end.
std::vector<Index> Portions(std::span<const Plan> plans, std::span<const Index> order, bool shares) {
  std::vector<Index> begins;
  for (Index k = 0; k < order.size(); ++k)
    if (k == 0 || !shares || k - begins.back() == kMostTogether ||
        CompareStep(plans[order[k - 1]], plans[order[k]], 0) != 0)
      begins.push_back(k);
  begins.push_back(order.size());
  return begins;
}

// A thread's own. The tube is made by the thread: that takes as long as many plans.
struct Worker {
  const Plan* last = nullptr;  // that it judged
  std::optional<Tube> own;
};

}  // namespace

std::vector<Decision> CertifyAll(const Certifier& certifier, std::span<const Plan> plans,
                                 std::span<const Zonotope> initial_sets, const ObstacleView& obstacles,
                                 const BatchOptions& options, const BatchListener& listener) {
  if (options.threads < 1) throw std::invalid_argument("batch: 0 threads, must be at least 1");
  if (!options.tubes.empty() && options.tubes.size() < options.threads)
    throw std::invalid_argument("batch: " + std::to_string(options.tubes.size()) + " tubes for " +
                                std::to_string(options.threads) + " threads");
  const bool one_for_all = initial_sets.size() == 1;
  if (!one_for_all && initial_sets.size() != plans.size())
    throw std::invalid_argument("batch: " + std::to_string(initial_sets.size()) + " initial sets, must be 1 or " +
                                std::to_string(plans.size()));
  std::vector<Decision> decisions(plans.size());
  const std::vector<Index> order = Gathered(plans, one_for_all);
  const std::vector<Index> begins = Portions(plans, order, one_for_all);
  const Index threads = std::clamp<Index>(begins.size() - 1, 1, options.threads);
  std::vector<Worker> workers(threads);
  std::atomic<Index> certified = plans.size();  // the first one so far
  const auto is_over = [&] { return options.clock && options.clock() >= options.deadline; };
  const auto judge = [&](Index i, Index thread) {
    auto& [last, own] = workers[thread];
    if (options.tubes.empty() && !own) own.emplace();
    Tube& tube = own ? *own : options.tubes[thread];
    const Plan* const before = std::exchange(last, &plans[i]);
    const int shared = one_for_all && before != nullptr ? SharedSteps(*before, plans[i]) : 0;
    decisions[i] = certifier.Certify(plans[i], initial_sets[one_for_all ? 0 : i], obstacles, tube, shared);
    if (decisions[i].outcome == Outcome::kCertified)
      for (Index known = certified; i < known && !certified.compare_exchange_weak(known, i);) {
      }
    if (listener) listener(i, decisions[i], tube);
  };
  ForEachInParallel(begins.size() - 1, options.threads, [&](Index portion, Index thread) {
    for (Index k = begins[portion]; k < begins[portion + 1]; ++k) {
      if (options.until_certified && order[k] > certified) continue;
      if (is_over()) return;
      judge(order[k], thread);
    }
  });
  // Other threads may have judged some of them before the first certified one was found.
  if (options.until_certified)
    std::ranges::fill(std::span(decisions).subspan(std::min(certified + 1, plans.size())), Decision{});
  return decisions;
}

}  // namespace forereach
