#include "research/systems.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <stdexcept>

#include "forereach/dynamics/models/kinematic_bicycle.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/models/point_mass.h"
#include "forereach/dynamics/models/residuals.h"
#include "research/random.h"

namespace forereach::research {
namespace {

constexpr PointMass kPointMass{0.15};
constexpr VelocityKnee kVelocityKnee{kPointMass.dt};
constexpr KinematicBicycle kBicycle{0.1, 2.5};
constexpr HeadingSaturation kHeadingSaturation{kBicycle.dt, kBicycle.wheelbase};
constexpr double kPi = std::numbers::pi;

template <class T, auto kEquations, auto kResidual>
void Step(std::span<const T> z, std::span<T> residual, std::span<T> next) {
  kEquations(z, next);
  kResidual(z, residual);
  for (std::size_t k = 0; k < next.size(); ++k) next[k] += residual[k];
}

template <auto kEquations, auto kResidual>
void Target(std::span<const long double> z, std::span<long double> next) {
  std::array<long double, kEquations.kStates> residual;
  Step<long double, kEquations, kResidual>(z, std::span<long double>(residual), next);
}

Eigen::VectorXd Vec(std::initializer_list<double> entries) {
  return Eigen::Map<const Eigen::VectorXd>(entries.begin(), static_cast<Eigen::Index>(entries.size()));
}

System MakePointMassSystem() {
  System system;
  system.name = "point_mass";
  system.model = MakePointMass(kPointMass.dt);
  system.domain.state = Box(Vec({-20, -20, -5.4, -5.4}), Vec({20, 20, 5.4, 5.4}));
  system.domain.input = Box(Vec({-3, -3}), Vec({3, 3}));
  system.domain.balls = {{{2, 3}, Vec({0, 0}), 5.4}};
  system.deployed = Eigen::MatrixXd::Zero(4, 6);
  system.deployed.middleCols(2, 2) << 0.006914008, 0.005689541,  //
      0.005689541, 0.006914008,                                  //
      0.092186775, 0.075860540,                                  //
      0.075860540, 0.092186775;
  system.data_region = Box(Vec({-20, -20, -0.5, -0.8, -3, -3}), Vec({20, 20, 3.5, 0.8, 3, 3}));
  system.quiet_region = Box(Vec({-20, -20, -0.2, -0.2, -3, -3}), Vec({20, 20, 0.2, 0.2, 3, 3}));
  system.initial_half_width = Vec({0.05, 0.05, 0.03, 0.03});
  system.horizon = 12;
  system.sample_sizes = {100};
  system.scenarios = 600;
  system.rollouts = 300;
  system.target = Target<kPointMass, kVelocityKnee>;
  system.step = Step<double, kPointMass, kVelocityKnee>;
  system.noise_scale = 0.05 * MedianResidual(system);
  return system;
}

System MakeBicycleSystem() {
  System system;
  system.name = "bicycle";
  system.model = MakeKinematicBicycle(kBicycle.dt, kBicycle.wheelbase);
  system.domain.state = Box(Vec({-40, -40, -kPi, 0, -3, -0.48}), Vec({40, 40, kPi, 25, 3, 0.48}));
  system.domain.input = Box(Vec({-20, -2}), Vec({20, 2}));
  system.deployed = Eigen::MatrixXd::Zero(6, 8);
  system.deployed(2, 3) = 0.017926410;
  system.deployed(2, 5) = 0.609638820;
  system.data_region = Box(Vec({-40, -40, -kPi, 7.25, -3, 0, -20, -2}), Vec({40, 40, kPi, 15.75, 3, 0.45, 20, 2}));
  system.quiet_region = Box(Vec({-40, -40, -kPi, 7.25, -3, 0, -20, -2}), Vec({40, 40, kPi, 9, 3, 0.1, 20, 2}));
  system.initial_half_width = Vec({0.025, 0.025, 0.005, 0.025, 0.01, 0.002});
  system.horizon = 12;
  system.sample_sizes = {25, 50, 100, 150, 200, 400};
  system.noise_scale = 4.16e-6;  // the paper's figure
  system.scenarios = 250;
  system.rollouts = 200;
  system.target = Target<kBicycle, kHeadingSaturation>;
  system.step = Step<double, kBicycle, kHeadingSaturation>;
  return system;
}

}  // namespace

const System& PointMassSystem() {
  static const System system = MakePointMassSystem();
  return system;
}

const System& BicycleSystem() {
  static const System system = MakeBicycleSystem();
  return system;
}

std::span<const System* const> Systems() {
  static const std::array<const System*, 2> systems{&PointMassSystem(), &BicycleSystem()};
  return systems;
}

const System& SystemNamed(const std::string& name) {
  for (const System* system : Systems())
    if (system->name == name) return *system;
  throw std::invalid_argument("system: " + name + " is not point_mass or bicycle");
}

double MedianResidual(const System& system, int points) {
  const Box& region = system.data_region;
  const auto n = static_cast<std::size_t>(system.num_states());
  std::vector<double> z(static_cast<std::size_t>(region.dim())), residual(n), next(n), sizes;
  std::vector<int> axes;  // on which the residual depends
  for (int l = 0; l < region.dim(); ++l) {
    z[static_cast<std::size_t>(l)] = (region.lower()[l] + region.upper()[l]) / 2;
    if (system.deployed.col(l).any()) axes.push_back(l);
  }
  std::vector<int> digits(axes.size(), 0);
  for (bool done = false; !done;) {
    for (std::size_t i = 0; i < axes.size(); ++i)
      z[static_cast<std::size_t>(axes[i])] =
          region.lower()[axes[i]] + (region.upper()[axes[i]] - region.lower()[axes[i]]) * (digits[i] + 0.5) / points;
    system.step(z, residual, next);
    sizes.push_back(std::abs(*std::ranges::max_element(residual, {}, [](double r) { return std::abs(r); })));
    const auto rises = std::ranges::find_if(digits, [&](int digit) { return digit + 1 < points; });
    std::fill(digits.begin(), rises, 0);
    done = rises == digits.end();
    if (!done) ++*rises;
  }
  const auto middle = sizes.begin() + std::ssize(sizes) / 2;
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle;
}

}  // namespace forereach::research
