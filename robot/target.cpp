#include "robot/target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "certifier/dynamics/kinematic_bicycle.h"
#include "certifier/dynamics/models.h"
#include "certifier/dynamics/point_mass.h"
#include "certifier/dynamics/residuals.h"
#include "certifier/numerics/limits.h"
#include "certifier/numerics/size.h"
#include "certifier/numerics/text.h"

namespace forereach {
namespace {

class NominalTarget final : public Target {
 public:
  explicit NominalTarget(std::shared_ptr<const NominalModel> model) : model_(std::move(model)) {}

  void Step(std::span<const double> x, std::span<const double> u, std::span<double> next) const override {
    std::array<double, kMaxVariables> z;
    std::copy(u.begin(), u.end(), std::copy(x.begin(), x.end(), z.begin()));
    model_->Evaluate(std::span<const double>(z.data(), x.size() + u.size()), next);
  }

 private:
  std::shared_ptr<const NominalModel> model_;
};

template <class Equations, class Residual>
class ResidualTarget final : public Target {
 public:
  ResidualTarget(Equations equations, Residual residual) : equations_(equations), residual_(residual) {}

  void Step(std::span<const double> x, std::span<const double> u, std::span<double> next) const override {
    using Wide = long double;
    std::array<Wide, Equations::kStates + Equations::kInputs> z;
    std::copy(u.begin(), u.end(), std::copy(x.begin(), x.end(), z.begin()));
    std::array<Wide, Equations::kStates> nominal, residual;
    equations_(std::span<const Wide>(z), std::span<Wide>(nominal));
    residual_(std::span<const Wide>(z), std::span<Wide>(residual));
    for (std::size_t k = 0; k < nominal.size(); ++k) next[k] = static_cast<double>(nominal[k] + residual[k]);
  }

 private:
  Equations equations_;
  Residual residual_;
};

[[noreturn]] void Fail(const Config& config, const std::string& what) {
  throw ConfigError(config.path + ": robot." + what);
}

// A target of another step or wheelbase would differ from the nominal model by more than the residual it names.
void RequireSameModel(const Config& config, const NominalModel& expected) {
  const NominalModel& model = *config.problem->model;
  if (model.description() != expected.description())
    Fail(config, "residual: " + config.robot.residual + " is for " + expected.description() + ", the model is " +
                     model.description());
}

std::shared_ptr<const NominalModel> ModelOf(const PointMass& model) { return MakePointMass(model.dt); }
std::shared_ptr<const NominalModel> ModelOf(const KinematicBicycle& model) {
  return MakeKinematicBicycle(model.dt, model.wheelbase);
}

// Parameters that are not given have the residual's own defaults, but for the first, which are the nominal model's.
template <class Residual>
auto Parameters(const Config& config) {
  const auto& given = config.robot.residual_parameters;
  auto values = Residual{}.parameters();
  for (const auto& [name, value] : given) {
    const auto* const known = std::ranges::find(Residual::kParameterNames, name);
    if (known == Residual::kParameterNames.end())
      Fail(config, "residual: " + config.robot.residual + " has no parameter " + name);
    if (!std::isfinite(value)) Fail(config, "residual: parameter " + name + " is not finite");
    values[ToSize(known - Residual::kParameterNames.begin())] = value;
  }
  for (const char* name : Residual::Nominal::kParameterNames)
    if (!given.contains(name)) Fail(config, "residual: " + config.robot.residual + " needs the parameter " + name);
  return values;
}

template <class Residual>
std::unique_ptr<Target> MakeResidualTarget(const Config& config) {
  using Nominal = typename Residual::Nominal;
  const auto values = Parameters<Residual>(config);
  const auto residual = std::apply([](auto... all) { return Residual{all...}; }, values);
  const auto nominal = [&]<std::size_t... i>(std::index_sequence<i...>) { return Nominal{values[i]...}; }
  (std::make_index_sequence<Nominal::kParameterNames.size()>());
  RequireSameModel(config, *ModelOf(nominal));
  return std::make_unique<ResidualTarget<Nominal, Residual>>(nominal, residual);
}

// std::uniform_real_distribution differs between libraries; this does not.
double Uniform(std::mt19937_64& random, double lower, double upper) {
  const double fraction = static_cast<double>(random() >> 11) * 0x1p-53;
  return std::min(lower + (upper - lower) * fraction, upper);
}

std::vector<Interval> SampleBounds(const Problem& problem, const std::vector<SampleRange>& ranges) {
  const std::vector<std::string> names = problem.model->variable_names();
  std::vector<Interval> bounds = problem.domain.Ranges();
  for (const SampleRange& range : ranges) {
    const auto name = std::find(names.begin(), names.end(), range.name);
    if (name == names.end()) throw std::invalid_argument("range: the model has no coordinate " + range.name);
    Interval& bound = bounds[ToSize(name - names.begin())];
    if (!(bound.lower <= range.lower && range.lower <= range.upper && range.upper <= bound.upper))
      throw std::invalid_argument("range: " + range.name + " in [" + ToText(range.lower) + ", " + ToText(range.upper) +
                                  "] is empty or not inside the domain's [" + ToText(bound.lower) + ", " +
                                  ToText(bound.upper) + "]");
    bound = {range.lower, range.upper};
  }
  return bounds;
}

std::vector<double> SampleInside(const Domain& domain, const std::vector<Interval>& bounds, std::mt19937_64& random) {
  std::vector<double> z(bounds.size());
  for (int attempt = 0; attempt < 1000; ++attempt) {
    for (std::size_t l = 0; l < z.size(); ++l) z[l] = Uniform(random, bounds[l].lower, bounds[l].upper);
    if (domain.Contains(z)) return z;
  }
  throw std::invalid_argument("ranges: no point inside the domain in 1000 samples");
}

}  // namespace

std::unique_ptr<Target> MakeTarget(const Config& config) {
  const std::string& residual = config.robot.residual;
  if (residual == HeadingSaturation::kName) return MakeResidualTarget<HeadingSaturation>(config);
  if (residual == VelocityKnee::kName) return MakeResidualTarget<VelocityKnee>(config);
  if (residual == "none") return std::make_unique<NominalTarget>(config.problem->model);
  Fail(config, "residual: " + residual + " is not none, heading_saturation or velocity_knee");
}

Transitions MakeTransitions(const Target& target, const Problem& problem, std::uint64_t seed, int count,
                            const std::vector<SampleRange>& ranges, const Eigen::VectorXd& noise_bound,
                            Disturbance* disturbance) {
  const int n = problem.model->num_states(), d = problem.model->num_variables();
  if (count < 0) throw std::invalid_argument("count: " + std::to_string(count) + " is negative");
  if (noise_bound.size() != 0 && noise_bound.size() != n)
    throw std::invalid_argument("noise_bound: " + std::to_string(noise_bound.size()) + " entries for " +
                                std::to_string(n) + " states");
  const std::vector<Interval> bounds = SampleBounds(problem, ranges);
  std::mt19937_64 random(seed);
  Transitions transitions{Eigen::MatrixXd(count, d), Eigen::MatrixXd(count, n)};
  std::vector<double> next(ToSize(n));
  for (int i = 0; i < count; ++i) {
    const std::vector<double> z = SampleInside(problem.domain, bounds, random);
    const std::span<const double> point(z);
    target.Step(point.first(next.size()), point.subspan(next.size()), next);
    if (disturbance) disturbance->Add(next);
    transitions.z.row(i) = Eigen::Map<const Eigen::RowVectorXd>(z.data(), d);
    transitions.x_next.row(i) = Eigen::Map<const Eigen::RowVectorXd>(next.data(), n);
    for (Eigen::Index k = 0; k < noise_bound.size(); ++k)
      transitions.x_next(i, k) += Uniform(random, -noise_bound(k), noise_bound(k));
  }
  return transitions;
}

}  // namespace forereach
