#include "research/truth.h"

#include <algorithm>
#include <cmath>

#include "research/random.h"

namespace forereach::research {

Rollouts::Rollouts(const System& system, const Scenario& scenario, int count)
    : n_(static_cast<std::size_t>(system.num_states())),
      count_(count),
      horizon_(static_cast<int>(scenario.controls.cols())),
      states_(static_cast<std::size_t>(count * (horizon_ + 1)) * n_),
      residuals_(static_cast<std::size_t>(count * horizon_) * n_) {
  Random random{0x747275746868, n_};
  const int corners = 1 << n_;
  const auto m = static_cast<std::size_t>(system.num_inputs());
  std::vector<double> z(n_ + m);
  double *state = states_.data(), *residual = residuals_.data();
  for (int i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < n_; ++k) {
      const double corner = ((i - 1) >> k & 1) != 0 ? 1 : -1;
      const double offset = i == 0 ? 0 : i <= corners ? corner : random.Uniform(-1, 1);
      const auto row = static_cast<Eigen::Index>(k);
      state[k] = scenario.center[row] + offset * system.initial_half_width[row];
    }
    for (int t = 0; t < horizon_; ++t, state += n_, residual += n_) {
      std::copy_n(state, n_, z.begin());
      for (std::size_t j = 0; j < m; ++j) z[n_ + j] = scenario.controls(static_cast<Eigen::Index>(j), t);
      system.step(z, {residual, n_}, {state + n_, n_});
    }
    state += n_;
  }
}

bool Rollouts::StayClearOf(const Circle& obstacle) const {
  for (std::size_t at = 0; at < states_.size(); at += n_)
    if (!(std::hypot(states_[at] - obstacle.center.x(), states_[at + 1] - obstacle.center.y()) > obstacle.radius))
      return false;
  return true;
}

}  // namespace forereach::research
