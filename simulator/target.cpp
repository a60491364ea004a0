#include "simulator/target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/step_rate.h"
#include "forereach/dynamics/text_program.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

class ModelTarget final : public Target {
 public:
  ModelTarget(std::shared_ptr<const NominalModel> model, StepTiming timing, std::optional<TextFunction> residual,
              std::uint64_t seed)
      : model_(std::move(model)), timing_(std::move(timing)), residual_(std::move(residual)) {
    if (timing_.error <= 0) return;
    rate_.emplace(TextOf(*model_).value());
    std::mt19937_64 random(seed ^ 0x706f776572);
    for (int k = 0; k < model_->num_states(); ++k)
      powers_.push_back(1 + static_cast<int>(random() % static_cast<std::uint64_t>(rate_->power())));
  }

  void Step(std::span<const double> x, std::span<const double> u, std::span<double> next,
            double longer) const override {
    std::array<double, kMaxVariables> all;
    std::copy(u.begin(), u.end(), std::copy(x.begin(), x.end(), all.begin()));
    const auto z = std::span<const double>(all).first(x.size() + u.size());
    std::array<long double, kMaxStates> nominal{}, residual{};
    // Rounded once, at the end: what is added by rounding must stay far below a declared noise_bound.
    model_->EvaluateWide(z, std::span(nominal).first(next.size()));
    if (residual_) residual_->Evaluate(z, std::span(residual).first(next.size()));
    for (std::size_t k = 0; k < next.size(); ++k) next[k] = static_cast<double>(nominal[k] + residual[k]);
    if (longer == 0) return;
    const double dt = StepOf(*model_);
    std::array<Interval, kMaxVariables> point;
    std::array<Interval, kMaxStates> rate;
    std::ranges::copy(z, point.begin());
    rate_.value().Enclose({point.data(), z.size()}, dt, std::span(rate).first(next.size()));
    for (std::size_t k = 0; k < next.size(); ++k)
      if (std::ranges::count(timing_.set_at_steps, static_cast<int>(k)) == 0)
        next[k] +=
            longer * rate[k].Middle() + (std::pow(1 + longer / dt, powers_[k]) - 1) * static_cast<double>(residual[k]);
  }

 private:
  std::shared_ptr<const NominalModel> model_;
  StepTiming timing_;
  std::optional<TextFunction> residual_;
  std::optional<StepRate> rate_;
  std::vector<int> powers_;  // of the duration, by which each state's residual grows
};

TextFunction FunctionOf(const ParametricResidual& residual, const NominalModel& model) {
  if (residual.names.states != model.state_names() || residual.names.inputs != model.input_names() ||
      residual.values.size() != residual.names.states.size())
    throw std::invalid_argument(fmt::format("for other states or inputs than those of {}", model.name()));
  return {residual.names, residual.values};
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
    if (name == names.end())
      throw std::invalid_argument(fmt::format("range: the model has no coordinate {}", range.name));
    Interval& bound = bounds[ToSize(name - names.begin())];
    if (!(bound.lower <= range.lower && range.lower <= range.upper && range.upper <= bound.upper))
      throw std::invalid_argument(fmt::format("range: {} in [{}, {}] is empty or not inside the domain's [{}, {}]",
                                              range.name, ToText(range.lower), ToText(range.upper), ToText(bound.lower),
                                              ToText(bound.upper)));
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
  std::optional<TextFunction> residual;
  try {
    if (config.robot_residual) residual = FunctionOf(*config.robot_residual, *config.problem->model);
  } catch (const std::invalid_argument& error) {
    throw ConfigError("{}: robot.residual: {}: {}", config.path, config.robot_residual->name, error.what());
  }
  return std::make_unique<ModelTarget>(config.problem->model, config.problem->timing, std::move(residual),
                                       static_cast<std::uint64_t>(config.robot.disturbance_seed));
}

Transitions MakeTransitions(const Target& target, const Problem& problem, std::uint64_t seed, int count,
                            const std::vector<SampleRange>& ranges, const Eigen::VectorXd& noise_bound,
                            Disturbance* disturbance) {
  const int n = problem.model->num_states(), d = problem.model->num_variables();
  if (count < 0) throw std::invalid_argument(fmt::format("count: {} is negative", count));
  if (noise_bound.size() != 0 && noise_bound.size() != n)
    throw std::invalid_argument(fmt::format("noise_bound: {} entries for {} states", noise_bound.size(), n));
  const std::vector<Interval> bounds = SampleBounds(problem, ranges);
  std::mt19937_64 random(seed);
  Transitions transitions{Eigen::MatrixXd(count, d), Eigen::MatrixXd(count, n)};
  std::vector<double> next(ToSize(n));
  for (int i = 0; i < count; ++i) {
    const std::vector<double> z = SampleInside(problem.domain, bounds, random);
    const std::span<const double> point(z);
    target.Step(point.first(next.size()), point.subspan(next.size()), next);
    if (disturbance) disturbance->Add(next, point);
    transitions.z.row(i) = Eigen::Map<const Eigen::RowVectorXd>(z.data(), d);
    transitions.x_next.row(i) = Eigen::Map<const Eigen::RowVectorXd>(next.data(), n);
    for (Eigen::Index k = 0; k < noise_bound.size(); ++k)
      transitions.x_next(i, k) += Uniform(random, -noise_bound(k), noise_bound(k));
  }
  return transitions;
}

}  // namespace forereach
