#include "research/scenarios.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "research/chunks/blocks.h"
#include "research/random.h"

namespace forereach::research {
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

Eigen::MatrixXd DrawPoints(const Box& region, int seed, int count, std::uint64_t system_key) {
  Random random{kForPoints, system_key, static_cast<std::uint64_t>(seed)};
  Eigen::MatrixXd points(count, region.dim());
  for (int i = 0; i < count; ++i)
    for (int l = 0; l < region.dim(); ++l) points(i, l) = random.Uniform(region.lower()[l], region.upper()[l]);
  return points;
}

Eigen::MatrixXd PointsOf(const System& system, Layout layout, int seed, int count) {
  const auto drawn = [&](const Box& region) {
    return DrawPoints(region, seed, count, static_cast<std::uint64_t>(system.num_states()));
  };
  switch (layout) {
    case Layout::kFixedGrid: return GridPoints(count);
    case Layout::kPolicyCorridor: return PolicyPoints(seed, count);
    case Layout::kCorridor: return drawn(system.data_region);
    case Layout::kBelowKnee: return drawn(system.quiet_region);
  }
  throw std::invalid_argument("layout: " + std::to_string(static_cast<int>(layout)) + " is unknown");
}

}  // namespace

Circle PlaceBeside(const System& system, const Eigen::VectorXd& center, const Eigen::MatrixXd& controls, int k,
                   double aside, double radius) {
  const auto n = static_cast<std::size_t>(system.num_states()), m = static_cast<std::size_t>(system.num_inputs());
  std::vector<double> z(n + m), residual(n), next(center.begin(), center.end());
  Eigen::Vector2d before = center.head<2>(), position = before;
  for (int t = 0; t < k; ++t) {
    std::copy_n(controls.col(t).data(), m, std::copy(next.begin(), next.end(), z.begin()));
    system.step(z, residual, next);
    before = position;
    position = {next[0], next[1]};
  }
  const Eigen::Vector2d along = (position - before).normalized();
  return {position + aside * Eigen::Vector2d(-along.y(), along.x()), radius};
}

Scenario MakeScenario(const System& system, Group group, int seed, int index) {
  if (&system == &ChunkSystem()) return MakeChunkScenario(group, seed, index);
  Random random{kForScenario, static_cast<std::uint64_t>(system.num_states()), static_cast<std::uint64_t>(group),
                static_cast<std::uint64_t>(seed), static_cast<std::uint64_t>(index)};
  const Start start =
      system.num_states() == BicycleSystem().num_states() ? BicycleStart(group, random) : PointMassStart(group, random);
  const Eigen::MatrixXd controls = start.control.replicate(1, system.horizon);
  const int k = random.Integer(system.horizon - 3, system.horizon);
  const double aside = index % 2 == 0 ? start.radius + random.Uniform(start.least_clearance, start.largest_clearance)
                                      : random.Uniform(0, 0.8) * start.radius;
  return {start.center, controls, PlaceBeside(system, start.center, controls, k, aside * start.side, start.radius)};
}

Transitions MakeData(const System& system, Layout layout, int seed, int count, double noise_scale, double cut) {
  Random noise{kForNoise, static_cast<std::uint64_t>(system.num_states()), static_cast<std::uint64_t>(seed)};
  const int n = system.num_states();
  Transitions data{PointsOf(system, layout, seed, count), Eigen::MatrixXd(count, n)};
  std::vector<long double> z(static_cast<std::size_t>(data.z.cols())), next(static_cast<std::size_t>(n));
  for (int i = 0; i < count; ++i) {
    std::ranges::copy(data.z.row(i), z.begin());
    system.target(z, next);
    for (int k = 0; k < n; ++k)
      data.x_next(i, k) = static_cast<double>(next[static_cast<std::size_t>(k)] +
                                              noise.TruncatedNormal(noise_scale, NoiseBound(noise_scale, cut)));
  }
  return data;
}

}  // namespace forereach::research
