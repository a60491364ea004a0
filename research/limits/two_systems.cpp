#include "research/limits/two_systems.h"

#include <cmath>

namespace forereach::research {

long double Bump::operator()(std::span<const long double> z) const {
  long double square = 0;
  for (std::size_t l = 0; l < z.size(); ++l) {
    const long double away = (z[l] - center[static_cast<Eigen::Index>(l)]) / radius;
    square += away * away;
  }
  return square < 1 ? std::exp(1 - 1 / (1 - square)) : 0;
}

Eigen::MatrixXd Rollout::States(const Bump* bump, int k, double amplitude) const {
  const Eigen::Index n = start.size(), variables = n + plan.num_inputs;
  Eigen::MatrixXd states(n, plan.num_steps + 1);
  states.col(0) = start;
  Eigen::VectorXd z(variables), next(n);
  std::vector<long double> wide(static_cast<std::size_t>(variables)), r(static_cast<std::size_t>(n));
  for (int t = 0; t < plan.num_steps; ++t) {
    const std::span<const double> input = plan.input(t);
    z.head(n) = states.col(t);
    for (std::size_t j = 0; j < input.size(); ++j) z[n + static_cast<Eigen::Index>(j)] = input[j];
    std::copy(z.begin(), z.end(), wide.begin());
    model.Evaluate({z.data(), static_cast<std::size_t>(variables)}, {next.data(), static_cast<std::size_t>(n)});
    residual.evaluate(wide, r);
    if (bump) r[static_cast<std::size_t>(k)] += amplitude * (*bump)(wide);
    for (Eigen::Index i = 0; i < n; ++i)
      states(i, t + 1) = static_cast<double>(next[i] + r[static_cast<std::size_t>(i)]);
  }
  return states;
}

Eigen::MatrixXd Rollout::Queries() const {
  const Eigen::MatrixXd states = States();
  Eigen::MatrixXd queries(start.size() + plan.num_inputs, plan.num_steps);
  for (int t = 0; t < plan.num_steps; ++t) {
    queries.col(t).head(start.size()) = states.col(t);
    for (int j = 0; j < plan.num_inputs; ++j) queries(start.size() + j, t) = plan.input(t)[static_cast<std::size_t>(j)];
  }
  return queries;
}

Pair RollOutPair(const Rollout& rollout, const Bump& bump, int k, double amplitude) {
  return {rollout.States(&bump, k, amplitude), rollout.States(&bump, k, -amplitude)};
}

}  // namespace forereach::research
