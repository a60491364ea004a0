/** What the target really does under a plan, by Monte Carlo: the truth that certificates and tubes are held against. */
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "research/scenarios.h"

namespace forereach::research {

/** Trajectories of the target under one plan, from states in X0. In plain arithmetic. */
class Rollouts final {
 public:
  /** The first starts at the center of X0, the next at its 2^n corners, the others uniformly in it; `count` in all.
  Deterministic: the starts depend on the system alone. Cost: count * T steps. @pre count >= 1 */
  Rollouts(const System& system, const Scenario& scenario, int count);

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] int horizon() const { return horizon_; }
  /** x_t of rollout i, t = 0..T. */
  [[nodiscard]] std::span<const double> state(int i, int t) const {
    return std::span(states_).subspan(static_cast<std::size_t>(i * (horizon_ + 1) + t) * n_, n_);
  }
  /** r*(x_t, u_t) of rollout i, t < T. */
  [[nodiscard]] std::span<const double> residual(int i, int t) const {
    return std::span(residuals_).subspan(static_cast<std::size_t>(i * horizon_ + t) * n_, n_);
  }

  /** Whether no rollout touches the obstacle at t = 0..T: what "target-safe" means here. */
  [[nodiscard]] bool StayClearOf(const Circle& obstacle) const;

 private:
  std::size_t n_;
  int count_, horizon_;
  std::vector<double> states_, residuals_;
};

}  // namespace forereach::research
