#include "experiments/scenarios.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "experiments/random.h"

namespace forereach::experiments {
namespace {

// What a generator is for.
enum : std::uint64_t { kForScenario = 1, kForPoints = 2, kForNoise = 3 };

struct Start {
  Eigen::VectorXd center;
  Eigen::Vector2d control;
  double radius, least_clearance, largest_clearance;
  double side;  // +1: left of the path, -1: right
};

Start BicycleStart(Group group, Random& random) {
  const double mirror = group == Group::kB ? -1 : 1;
  Start start{Eigen::VectorXd::Zero(6), {}, 1, 0.5, 2.5, 0};
  start.center[3] = random.Uniform(9, 15);
  start.center[5] = group == Group::kA ? random.Uniform(0.04, 0.12) : mirror * random.Uniform(0.25, 0.40);
  start.control[0] = random.Uniform(-0.5, 0.5);
  start.control[1] = mirror * random.Uniform(-0.05, 0.05);
  const double random_side = random.Coin() ? 1 : -1;
  start.side = group == Group::kA ? random_side : -mirror;  // a left curve's outside is on the right
  return start;
}

Start PointMassStart(Group group, Random& random) {
  Start start{Eigen::VectorXd::Zero(4), {}, 0.8, 0.6, 1.6, 0};
  const double vx = group == Group::kA ? random.Uniform(0.1, 0.8) : random.Uniform(1, 3);
  start.center[2] = group == Group::kB ? -vx : vx;
  start.center[3] = random.Uniform(-0.4, 0.4);
  for (int j = 0; j < 2; ++j) start.control[j] = random.Uniform(-0.3, 0.3);
  start.side = random.Coin() ? 1 : -1;
  return start;
}

// Where the target's rollout from the center is at step k, and the unit normal to the left of its last step.
struct Place {
  Eigen::Vector2d position, left;
};

Place Follow(const System& system, const Start& start, int k) {
  const auto n = static_cast<std::size_t>(system.num_states());
  std::vector<double> z(n + 2), residual(n), next(n);
  std::copy(start.center.begin(), start.center.end(), z.begin());
  std::copy(start.control.begin(), start.control.end(), z.begin() + static_cast<std::ptrdiff_t>(n));
  Eigen::Vector2d before{z[0], z[1]}, position = before;
  for (int t = 0; t < k; ++t) {
    system.step(z, residual, next);
    std::copy(next.begin(), next.end(), z.begin());
    before = position;
    position = {z[0], z[1]};
  }
  const Eigen::Vector2d along = (position - before).normalized();
  return {position, {-along.y(), along.x()}};
}

}  // namespace

Scenario MakeScenario(const System& system, Group group, int seed, int index) {
  Random random{kForScenario, static_cast<std::uint64_t>(system.num_states()), static_cast<std::uint64_t>(group),
                static_cast<std::uint64_t>(seed), static_cast<std::uint64_t>(index)};
  const Start start = system.num_states() == BicycleSystem().num_states() ? BicycleStart(group, random) : PointMassStart(group, random);
  const Place place = Follow(system, start, random.Integer(system.horizon - 3, system.horizon));
  const bool safe = index % 2 == 0;
  const double aside = safe ? start.radius + random.Uniform(start.least_clearance, start.largest_clearance)
                            : random.Uniform(0, 0.8) * start.radius;
  return {start.center,
          start.control.replicate(1, system.horizon),
          {place.position + aside * start.side * place.left, start.radius}};
}

Transitions MakeData(const System& system, Layout layout, int seed, int count, double noise_scale) {
  const auto system_key = static_cast<std::uint64_t>(system.num_states()), seed_key = static_cast<std::uint64_t>(seed);
  Random points{kForPoints, system_key, seed_key}, noise{kForNoise, system_key, seed_key};
  const Box& region = layout == Layout::kCorridor ? system.data_region : system.quiet_region;
  const int n = system.num_states();
  Transitions data{Eigen::MatrixXd(count, region.dim()), Eigen::MatrixXd(count, n)};
  std::vector<long double> z(static_cast<std::size_t>(region.dim())), next(static_cast<std::size_t>(n));
  for (int i = 0; i < count; ++i) {
    for (int l = 0; l < region.dim(); ++l) {
      data.z(i, l) = points.Uniform(region.lower()[l], region.upper()[l]);
      z[static_cast<std::size_t>(l)] = data.z(i, l);
    }
    system.target(z, next);
    for (int k = 0; k < n; ++k)
      data.x_next(i, k) = static_cast<double>(next[static_cast<std::size_t>(k)] +
                                              noise.TruncatedNormal(noise_scale, NoiseBound(noise_scale)));
  }
  return data;
}

}  // namespace forereach::experiments
