#include "research/variants.h"
#include "research/equations_slopes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "forereach/declare/slope_bound.h"
#include "forereach/dynamics/equations_model.h"
#include "forereach/dynamics/models/kinematic_bicycle.h"
#include "forereach/dynamics/models/point_mass.h"
#include "forereach/dynamics/models/residuals.h"
#include "forereach/numerics/text.h"
#include "research/norm_ratio.h"

namespace forereach::research {
namespace {

// The nominal model with one more parameter: its known part, or that of the motion.
template <class Equations, bool kOfMotion>
struct Partly {
  static constexpr int kStates = Equations::kStates, kInputs = Equations::kInputs;
  static constexpr std::size_t kOwn = Equations::kParameterNames.size();
  static constexpr const char* kName = "degraded";
  static constexpr auto kStateNames = Equations::kStateNames;
  static constexpr auto kInputNames = Equations::kInputNames;
  static constexpr std::array<const char*, kOwn + 1> kParameterNames = [] {
    std::array<const char*, kOwn + 1> names{};
    std::copy(Equations::kParameterNames.begin(), Equations::kParameterNames.end(), names.begin());
    names[kOwn] = "known";
    return names;
  }();

  std::array<double, kOwn + 1> values;

  template <class T>
  static constexpr void Step(std::span<const T> parameters, std::span<const T> z, std::span<T> next) {
    Equations::template Step<T>(parameters, z, next);
    for (std::size_t k = 0; k < next.size(); ++k)
      next[k] = kOfMotion ? z[k] + parameters[kOwn] * (next[k] - z[k]) : parameters[kOwn] * next[k];
  }

  [[nodiscard]] std::array<double, kOwn + 1> parameters() const { return values; }
};

template <class Equations, bool kOfMotion>
std::shared_ptr<const NominalModel> MakePartly(const NominalModel& whole, double known) {
  using Degraded = Partly<Equations, kOfMotion>;
  Degraded equations{};
  std::ranges::copy(whole.parameters(), equations.values.begin());
  equations.values.back() = known;
  return std::make_shared<EquationsModel<Degraded>>(equations);
}

template <bool kOfMotion>
std::shared_ptr<const NominalModel> MakePartly(const System& system, double known) {
  return system.num_states() == KinematicBicycle::kStates
             ? MakePartly<KinematicBicycle, kOfMotion>(*system.model, known)
             : MakePartly<PointMass, kOfMotion>(*system.model, known);
}

// Entries of L lie above the true slopes by this part of them, so that rounding makes no declaration false.
constexpr double kSlack = 1e-12;

const Eigen::MatrixXd& LargestSlopesOnce(const System& system) {
  static std::map<const System*, Eigen::MatrixXd> known;
  const auto [at, is_new] = known.try_emplace(&system);
  if (is_new) at->second = LargestSlopes(system);
  return at->second;
}

// sup |D(f0 - x)|: the diagonal of D f0 is one, everywhere and in both models.
Eigen::MatrixXd LargestSlopesOfMotion(const System& system) {
  Eigen::MatrixXd slopes = LargestSlopesOnce(system);
  for (Eigen::Index k = 0; k < slopes.rows(); ++k)
    if (std::exchange(slopes(k, k), 0) != 1) throw std::logic_error("the motion's slopes are not known");
  return slopes;
}

System MakeDegraded(const System& system, double part, Lacking what) {
  static constexpr const char* kNames[] = {"_without_", "_unmoved_by_", "_declared_without_", "_declared_unmoved_by_"};
  const double known = 1 - part, lacking = 1 - known;
  const bool of_motion = what == Lacking::kMotion || what == Lacking::kDeclarationOfMotion;
  System degraded = system;
  degraded.name += kNames[static_cast<std::size_t>(what)] + ToText(100 * part) + "_percent";
  const Eigen::MatrixXd slopes = of_motion ? LargestSlopesOfMotion(system) : LargestSlopesOnce(system);
  degraded.deployed = (1 + kSlack) * (system.deployed + lacking * slopes);
  if (what == Lacking::kDeclaration || what == Lacking::kDeclarationOfMotion) return degraded;
  degraded.model = of_motion ? MakePartly<true>(system, known) : MakePartly<false>(system, known);
  degraded.step = [whole = system.step, lacking, of_motion](std::span<const double> z, std::span<double> residual,
                                                            std::span<double> next) {
    whole(z, residual, next);
    for (std::size_t k = 0; k < next.size(); ++k)
      residual[k] += lacking * (next[k] - residual[k] - (of_motion ? z[k] : 0));
  };
  return degraded;
}

constexpr PointMass kPointMass{0.15};
constexpr double kRate = 0.15, kDamping = 0.4, kCross = 0.3;
template <class T>
void StepLinear(std::span<const T> z, std::span<T> residual, std::span<T> next) {
  const T dt = kPointMass.dt, vx = z[2], vy = z[3];
  const std::array<T, 2> acceleration{-kRate * (kDamping * vx + kCross * vy), kRate * (kCross * vx - kDamping * vy)};
  kPointMass(z, next);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    residual[axis] = dt * dt / 2 * acceleration[axis];
    residual[axis + 2] = dt * acceleration[axis];
  }
  for (std::size_t k = 0; k < next.size(); ++k) next[k] += residual[k];
}

System MakeLinearPointMass() {
  System system = PointMassSystem();
  system.name = "linear_point_mass";
  system.scenarios = 100;  // some hundred linear programs each
  const double dt = kPointMass.dt;
  system.deployed.setZero();
  for (int axis = 0; axis < 2; ++axis)
    for (int from = 0; from < 2; ++from) {
      const double slope = kRate * (axis == from ? kDamping : kCross) * (1 + kSlack);
      system.deployed(axis, 2 + from) = dt * dt / 2 * slope;
      system.deployed(axis + 2, 2 + from) = dt * slope;
    }
  system.target = [](std::span<const long double> z, std::span<long double> next) {
    std::array<long double, 4> residual;
    StepLinear<long double>(z, residual, next);
  };
  system.step = StepLinear<double>;
  return system;
}

struct EscapingKnee {
  using Nominal = PointMass;
  static constexpr const char* kName = "escaping_knee";
  static constexpr std::array<const char*, 8> kParameterNames{
      "dt", "damping", "cross", "knee", "softplus_temperature", "regularizer", "smoothing", "steepening"};

  template <class T>
  static void Evaluate(std::span<const T> parameters, std::span<const T> z, std::span<T> residual) {
    using std::sqrt;
    VelocityKnee::Evaluate<T>(parameters.first(7), z, residual);
    const T speed = sqrt(z[2] * z[2] + z[3] * z[3] + parameters[6]);
    const T factor = T(1) + parameters[7] * SmoothGate((speed - parameters[3]) / parameters[4]);
    for (T& r : residual) r = factor * r;
  }
};

template <class T = double>
std::array<T, 8> EscapeParameters(double lambda) {
  std::array<T, 8> parameters{};
  std::ranges::copy(VelocityKnee{kPointMass.dt}.parameters(), parameters.begin());
  parameters[7] = lambda - 1;
  return parameters;
}

template <class T>
void StepEscaping(double lambda, std::span<const T> z, std::span<T> residual, std::span<T> next) {
  EscapingKnee::Evaluate<T>(EscapeParameters<T>(lambda), z, residual);
  kPointMass(z, next);
  for (std::size_t k = 0; k < next.size(); ++k) next[k] += residual[k];
}

// A quarter turn of v turns the residual with it, and positions move by dt / 2 of what velocities change: two entries
// are all there is to bound.
Eigen::MatrixXd BoundEscape(const Domain& domain, double lambda) {
  std::vector<Interval> parameters;
  for (const double value : EscapeParameters(lambda)) parameters.push_back({value, value});
  const EquationsSlopes<EscapingKnee> slopes;
  Eigen::MatrixXd bound = Eigen::MatrixXd::Zero(4, 6);
  for (int other = 0; other < 2; ++other) {
    const double slope = BoundSlope(slopes, domain, parameters, 2, 2 + other, {.gap = 1e-3}).upper;
    for (int axis = 0; axis < 2; ++axis) {
      bound(2 + axis, 2 + (axis ^ other)) = slope;
      bound(axis, 2 + (axis ^ other)) = kPointMass.dt / 2 * slope * (1 + kSlack);
    }
  }
  return bound;
}

System MakeEscaping(double lambda) {
  System system = PointMassSystem();
  system.name = "escape_" + ToText(lambda);
  system.scenarios = 100;
  system.deployed = BoundEscape(system.domain, lambda);
  system.target = [lambda](std::span<const long double> z, std::span<long double> next) {
    std::array<long double, 4> residual;
    StepEscaping<long double>(lambda, z, residual, next);
  };
  system.step = [lambda](std::span<const double> z, std::span<double> residual, std::span<double> next) {
    StepEscaping<double>(lambda, z, residual, next);
  };
  return system;
}

}  // namespace

const System& WithFewerPlans(const System& system, int scenarios) {
  static std::map<std::pair<const System*, int>, System> known;
  const auto [at, is_new] = known.try_emplace({&system, scenarios}, system);
  if (is_new) {
    at->second.name += "_" + std::to_string(scenarios) + "_plans";
    at->second.scenarios = std::min(system.scenarios, scenarios);
  }
  return at->second;
}

const System& Degraded(const System& system, double part, Lacking lacking) {
  static std::map<std::tuple<const System*, double, Lacking>, System> known;
  const auto [at, is_new] = known.try_emplace({&system, part, lacking});
  if (is_new) at->second = MakeDegraded(system, part, lacking);
  return at->second;
}

const System& LinearPointMass() {
  static const System system = MakeLinearPointMass();
  return system;
}

const System& Escaping(double lambda) {
  static std::map<double, System> known;
  const auto [at, is_new] = known.try_emplace(lambda);
  if (is_new) at->second = MakeEscaping(lambda);
  return at->second;
}

double EscapeAt(double lambda, double speed) {
  std::array<double, 4> residual;
  EscapingKnee::Evaluate<double>(EscapeParameters(lambda), std::array{0.0, 0.0, speed, 0.0, 0.0, 0.0}, residual);
  return std::hypot(residual[2], residual[3]) / kPointMass.dt;
}

}  // namespace forereach::research
