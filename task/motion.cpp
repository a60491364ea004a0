#include "task/motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

// @throws ConfigError if the task does not say how the robot brakes.
const Config& WithLaws(const Config& config) {
  if (config.laws.stop.empty())
    throw ConfigError(
        "{}: planner.stop: missing: how the robot brakes, an expression for each input, for example {{{}: "
        "...}}; `forereach init` writes it for the models of the library",
        config.path, config.problem->model->input_names()[0]);
  if (!config.laws.at_rest)
    throw ConfigError(
        "{}: planner.at_rest: missing: it says where a braking tail ends; by default where task.rest does, "
        "which is missing, too",
        config.path);
  return config;
}

Box ControlsOf(const Problem& problem) {
  Eigen::VectorXd lower = problem.domain.input.lower(), upper = problem.domain.input.upper();
  const Eigen::VectorXd& error = problem.declaration.input_error;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    if (!(error[i] > 0)) continue;
    // The input that acts is within this error of the plan's, and has to be inside the domain, too.
    lower[i] = AddUp(lower[i], error[i]);
    upper[i] = SubDown(upper[i], error[i]);
    // An error that is wider than the box leaves its middle: the certifier refuses such a plan and says why.
    if (lower[i] > upper[i]) lower[i] = upper[i] = lower[i] / 2 + upper[i] / 2;
  }
  return {lower, upper};
}

}  // namespace

RobotMotion::RobotMotion(const Config& config, Braking braking)
    : problem_(WithLaws(config).problem),
      controls_(ControlsOf(*problem_)),
      dt_(StepOf(*problem_->model)),
      held_(HeldStates(config)),
      at_rest_(*config.laws.at_rest) {
  const Laws& laws = config.laws;
  const NominalModel& model = *problem_->model;
  for (const Law& law : braking == Braking::kHardest && !laws.emergency_stop.empty() ? laws.emergency_stop : laws.stop)
    stops_.push_back(MakeStopLaw(model, laws, law));
  if (!laws.back_off.empty()) back_off_.emplace(MakeStopLaw(model, laws, laws.back_off));
  if (!laws.hints.empty()) hints_.emplace(MakeHints(model, laws));
  if (laws.speed) speed_.emplace(MakeSpeed(model, laws));
}

// Without an expression: along the way of one step.
double RobotMotion::Speed(std::span<const double> x) const {
  if (speed_) {
    long double speed;
    speed_->Evaluate(x, {&speed, 1});
    return static_cast<double>(speed);
  }
  std::array<double, kMaxInputs> u;
  std::array<double, kMaxStates> next;
  Coast(x, {u.data(), inputs()});
  Step(x, {u.data(), inputs()}, {next.data(), x.size()});
  const auto states = std::ssize(x);
  const Eigen::Map<const Eigen::VectorXd> from(x.data(), states), to(next.data(), states);
  return (problem_->projection * (to - from)).norm() / dt();
}

bool RobotMotion::IsAtRest(std::span<const double> x) const { return !at_rest_.empty() && Rests(x); }

// The control that holds the robot where it is: the law, as if it stood.
void RobotMotion::Coast(std::span<const double> x, std::span<double> u) const {
  std::array<double, kMaxStates> held;
  std::ranges::copy(x, held.begin());
  Hold({held.data(), x.size()});
  Control(stops_[0], {held.data(), x.size()}, u);
}

void RobotMotion::Pursue(std::span<const double> x, const DesiredMotion& desired, std::span<double> u) const {
  std::array<double, kMaxStates + kDesired> z;
  const auto end = std::ranges::copy(x, z.begin()).out;
  *end = desired.heading;
  *(end + 1) = desired.speed;
  *(end + 2) = desired.climb;
  Control(*hints_, {z.data(), x.size() + kDesired}, u);
}

// Without hints between the one that was drawn and the one that stops the robot, which keeps upright one that would
// fall.
void RobotMotion::Explore(std::span<const double> x, double share, std::span<double> u) const {
  if (has_hints()) return;
  std::array<double, kMaxInputs> base;
  Control(stops_[0], x, {base.data(), u.size()});
  for (std::size_t k = 0; k < u.size(); ++k) u[k] = Clipped(k, base[k] + share * (u[k] - base[k]));
}

void RobotMotion::Hold(std::span<double> x) const {
  for (const int k : held_) x[ToSize(k)] = 0;
}

bool RobotMotion::Brake(std::span<const double> x, int tail, int max_steps, Eigen::MatrixXd& controls) const {
  std::array<double, kMaxStates> state, next;
  std::ranges::copy(x, state.begin());
  const std::size_t n = x.size();
  std::vector<double> steps;
  for (int t = 0; at_rest_.empty() ? t < max_steps : !Rests({state.data(), n}); ++t) {
    if (t == max_steps) return false;
    steps.resize(steps.size() + inputs());
    const std::span<double> u = std::span(steps).last(inputs());
    Control(stops_[ToSize(tail)], {state.data(), n}, u);
    Step({state.data(), n}, u, {next.data(), n});
    std::copy_n(next.begin(), n, state.begin());
  }
  controls = Eigen::Map<const Eigen::MatrixXd>(steps.data(), static_cast<Eigen::Index>(inputs()),
                                               std::ssize(steps) / static_cast<Eigen::Index>(inputs()));
  return controls.allFinite();
}

bool RobotMotion::BackOff(std::span<const double> x, int steps, int max_tail, Eigen::MatrixXd& controls) const {
  const auto m = static_cast<Eigen::Index>(inputs());
  Eigen::MatrixXd away(m, steps), tail;
  std::vector<double> state(x.begin(), x.end()), next(x.size());
  for (Eigen::Index t = 0; t < steps; ++t) {
    const std::span<double> u(away.col(t).data(), inputs());
    Control(*back_off_, state, u);
    Step(state, u, next);
    state.swap(next);
  }
  if (!Brake(state, 0, max_tail, tail)) return false;
  controls.resize(m, steps + tail.cols());
  controls << away, tail;
  return controls.allFinite();
}

std::size_t RobotMotion::inputs() const { return ToSize(problem_->model->num_inputs()); }

// Not for a state that is no number.
bool RobotMotion::Rests(std::span<const double> x) const {
  return std::ranges::all_of(
      at_rest_, [&](const RestBound& bound) { return std::abs(x[ToSize(bound.coordinate)]) <= bound.tolerance; });
}

double RobotMotion::Clipped(std::size_t k, double value) const {
  const auto i = static_cast<Eigen::Index>(k);
  return std::clamp(value, controls_.lower()[i], controls_.upper()[i]);
}

void RobotMotion::Control(const TextFunction& law, std::span<const double> z, std::span<double> u) const {
  std::array<long double, kMaxInputs> values;
  law.Evaluate(z, {values.data(), u.size()});
  for (std::size_t k = 0; k < u.size(); ++k) u[k] = Clipped(k, static_cast<double>(values[k]));
}

void RobotMotion::Step(std::span<const double> x, std::span<const double> u, std::span<double> next) const {
  std::array<double, kMaxVariables> z;
  std::ranges::copy(u, std::ranges::copy(x, z.begin()).out);
  problem_->model->Evaluate({z.data(), x.size() + u.size()}, next);
}

}  // namespace forereach
