#include "research/noise_floor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "forereach/sets/zonogon.h"
#include "research/evaluate.h"
#include "research/experiment.h"
#include "research/membership.h"
#include "research/methods/envelope.h"

namespace forereach::research {
namespace {

// In the middle of the corridor.
Scenario Middle(const System& system) {
  const bool is_bicycle = system.num_states() == BicycleSystem().num_states();
  Eigen::VectorXd start = Eigen::VectorXd::Zero(system.num_states());
  if (is_bicycle)
    start[3] = 12, start[5] = 0.3;
  else
    start[2] = 2;
  const Eigen::Vector2d control = is_bicycle ? Eigen::Vector2d(0.2, 0.02) : Eigen::Vector2d(0.1, 0.1);
  return {start, control.replicate(1, system.horizon), {Eigen::Vector2d(0, 100), 1}};
}

Answer TubeOf(const System& system, const Scenario& scenario, double sigma) {
  const Transitions data = MakeData(system, Layout::kCorridor, 0, system.sample_sizes.back(), 0);
  const Declaration declaration{system.deployed, Eigen::VectorXd::Constant(system.num_states(), sigma)};
  const auto residual = MakeForeReach({*system.model, system.domain, declaration, data, 0});
  System from_a_point = system;
  from_a_point.initial_half_width.setZero();
  Answer answer;
  Evaluator(from_a_point, *residual, 5).Certify(scenario, answer);
  return answer;
}

}  // namespace

Eigen::MatrixXd ShiftedRollout(const System& system, const Eigen::VectorXd& start, const Eigen::MatrixXd& controls,
                               const Eigen::VectorXd& shift) {
  const auto n = static_cast<std::size_t>(start.size()), m = static_cast<std::size_t>(controls.rows());
  Eigen::MatrixXd states(start.size(), controls.cols() + 1);
  states.col(0) = start;
  std::vector<double> z(n + m), residual(n), next(n);
  for (Eigen::Index t = 0; t < controls.cols(); ++t) {
    std::copy_n(controls.col(t).data(), m, std::copy_n(states.col(t).data(), n, z.begin()));
    system.step(z, residual, next);
    for (std::size_t k = 0; k < n; ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      states(row, t + 1) = next[k] + shift[row];
    }
  }
  return states;
}

NoiseFloor FindNoiseFloor(const System& system, double sigma) {
  const Scenario scenario = Middle(system);
  const Answer answer = TubeOf(system, scenario, sigma);
  NoiseFloor floor{0, std::numeric_limits<double>::quiet_NaN(), 0};
  if (answer.IsComplete()) {
    const Zonotope& last = answer.tube.slice(answer.tube.length());
    floor.half_width = RadiusUpper(Zonotope(last.CenterVector().head(2), last.GeneratorMatrix().topRows(2)));
  }
  for (unsigned signs = 0; signs < 1U << system.num_states(); ++signs) {
    Eigen::VectorXd shift(system.num_states());
    for (int k = 0; k < system.num_states(); ++k) shift[k] = signs >> k & 1 ? sigma : -sigma;
    const Eigen::MatrixXd plus = ShiftedRollout(system, scenario.center, scenario.controls, shift),
                          minus = ShiftedRollout(system, scenario.center, scenario.controls, -shift);
    const Eigen::Vector2d apart = system.projection() * (plus.rightCols<1>() - minus.rightCols<1>());
    floor.half_distance = std::max(floor.half_distance, apart.norm() / 2);
    for (int t = 1; t <= answer.tube.length(); ++t)
      floor.escapes += Locate(answer.tube.slice(t), {plus.col(t).data(), static_cast<std::size_t>(plus.rows())}) ==
                       Membership::kOutside;
  }
  return floor;
}

Table NoiseFloorTable() {
  Table table{"Noise floor",
              "Two systems f* +- shift, |shift_k| = sigma in every coordinate, give the same observations under noise "
              "of at most sigma, and have the same slopes: every sound tube contains both. One plan in the middle of "
              "the corridor from one state, the largest N. The paper names such a witness and prints no figure of it."};
  for (const System* system : {&PointMassSystem(), &BicycleSystem()})
    for (const double sigma : {1e-4, 1e-3, 1e-2}) {
      const NoiseFloor floor = FindNoiseFloor(*system, sigma);
      const std::string where = fmt::format("{}, sigma = {:g}: ", system->name, sigma);
      const auto row = [&](const char* what, const Estimate& ours, int decimals) {
        table.Add(where + what, ours, decimals);
      };
      row("half the distance at T, m", floor.half_distance, 5);
      row("half-width of the tube at T, m", std::isfinite(floor.half_width) ? Estimate(floor.half_width) : Estimate(),
          5);
      row("states outside the tube", floor.escapes, 0);
    }
  return table;
}

}  // namespace forereach::research
