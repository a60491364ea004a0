#include "planner_bridge/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "certifier/dynamics/models.h"
#include "certifier/numerics/size.h"

namespace forereach {
namespace {

// Tails keep this distance from the domain's bounds, so that rounding does not move a control across a bound.
constexpr double kShareOfBound = 0.95;

// The largest magnitude that the bounds allow for both signs of a coordinate.
double Reach(const Box& box, int k) { return std::min(-box.lower()(k), box.upper()(k)); }

constexpr double kStandstill = 1e-3;  // m/s

/** Driving and braking by the laws of the task. */
class LawMotion final : public RobotMotion {
 public:
  LawMotion(const Config& config, Braking braking)
      : problem_(config.problem), held_(HeldStates(config)), at_rest_(*config.laws.at_rest) {
    const Laws& laws = config.laws;
    const NominalModel& model = *problem_->model;
    for (const Law& law :
         braking == Braking::kHardest && !laws.emergency_stop.empty() ? laws.emergency_stop : laws.stop)
      stops_.push_back(MakeStopLaw(model, laws, law));
    if (!laws.hints.empty()) hints_.emplace(MakeHints(model, laws));
    if (laws.speed) speed_.emplace(MakeSpeed(model, laws));
  }

  double dt() const override { return StepOf(*problem_->model); }

  // Without an expression: along the way of one step.
  double Speed(std::span<const double> x) const override {
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

  bool IsAtRest(std::span<const double> x) const override { return !at_rest_.empty() && Rests(x); }

  // The control that holds the robot where it is: the law, as if it stood.
  void Coast(std::span<const double> x, std::span<double> u) const override {
    std::array<double, kMaxStates> held;
    std::ranges::copy(x, held.begin());
    Hold({held.data(), x.size()});
    Control(stops_[0], {held.data(), x.size()}, u);
  }

  bool has_hints() const override { return hints_.has_value(); }
  void Pursue(std::span<const double> x, const DesiredMotion& desired, std::span<double> u) const override {
    std::array<double, kMaxStates + kDesired> z;
    const auto end = std::ranges::copy(x, z.begin()).out;
    *end = desired.heading;
    *(end + 1) = desired.speed;
    *(end + 2) = desired.climb;
    Control(*hints_, {z.data(), x.size() + kDesired}, u);
  }

  // Between the one that was drawn and the hint, or the control that stops the robot: either keeps upright one that
  // would fall.
  void Explore(std::span<const double> x, const DesiredMotion& desired, double share,
               std::span<double> u) const override {
    std::array<double, kMaxInputs> base;
    if (has_hints())
      Pursue(x, desired, {base.data(), u.size()});
    else
      Control(stops_[0], x, {base.data(), u.size()});
    for (std::size_t k = 0; k < u.size(); ++k) u[k] = Clipped(k, base[k] + share * (u[k] - base[k]));
  }

  void Hold(std::span<double> x) const override {
    for (const int k : held_) x[ToSize(k)] = 0;
  }

  int num_tails() const override { return static_cast<int>(stops_.size()); }

  bool Brake(std::span<const double> x, int tail, int max_steps, Eigen::MatrixXd& controls) const override {
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

  int num_stops() const override { return num_tails(); }
  bool Stop(std::span<const double> x, int way, int max_steps, Eigen::MatrixXd& controls) const override {
    return Brake(x, way, max_steps, controls);
  }

 private:
  [[nodiscard]] std::size_t inputs() const { return ToSize(problem_->model->num_inputs()); }

  // Not for a state that is no number.
  [[nodiscard]] bool Rests(std::span<const double> x) const {
    return std::ranges::all_of(
        at_rest_, [&](const RestBound& bound) { return std::abs(x[ToSize(bound.coordinate)]) <= bound.tolerance; });
  }

  [[nodiscard]] double Clipped(std::size_t k, double value) const {
    const Box& box = problem_->domain.input;
    const auto i = static_cast<Eigen::Index>(k);
    return std::clamp(value, box.lower()[i], box.upper()[i]);
  }

  void Control(const TextFunction& law, std::span<const double> z, std::span<double> u) const {
    std::array<long double, kMaxInputs> values;
    law.Evaluate(z, {values.data(), u.size()});
    for (std::size_t k = 0; k < u.size(); ++k) u[k] = Clipped(k, static_cast<double>(values[k]));
  }

  void Step(std::span<const double> x, std::span<const double> u, std::span<double> next) const {
    std::array<double, kMaxVariables> z;
    std::ranges::copy(u, std::ranges::copy(x, z.begin()).out);
    problem_->model->Evaluate({z.data(), x.size() + u.size()}, next);
  }

  const std::shared_ptr<const Problem> problem_;
  const std::vector<int> held_;
  const std::vector<RestBound> at_rest_;
  std::vector<TextFunction> stops_;
  std::optional<TextFunction> hints_, speed_;
};

/** What the compiled models have in common. Way 0 to stop holds the steering as it is; the others are the tails. */
class CompiledMotion : public RobotMotion {
 public:
  bool IsAtRest(std::span<const double> x) const override { return std::abs(Speed(x)) <= kStandstill; }
  void Coast(std::span<const double>, std::span<double> u) const override { std::ranges::fill(u, 0); }
  bool has_hints() const override { return true; }
  void Explore(std::span<const double>, const DesiredMotion&, double, std::span<double>) const override {}
  int num_stops() const override { return 1 + num_tails(); }
  bool Stop(std::span<const double> x, int way, int max_steps, Eigen::MatrixXd& controls) const override {
    if (!Brake(x, way == 0 ? 0 : way - 1, max_steps, controls)) return false;
    if (way == 0) HoldSteering(controls);
    return true;
  }

 private:
  // Changes the controls of a braking tail so that the wheels keep their angle; nothing without wheels.
  virtual void HoldSteering(Eigen::MatrixXd& controls) const = 0;
};

/** Jerk-limited deceleration to v = a = 0, while the wheels go to a bend, stay there for half of the time and then
return to straight ahead. */
class CarMotion final : public CompiledMotion {
 public:
  CarMotion(const Problem& problem, double braking)
      : dt_(problem.model->parameters()[0]),
        deceleration_(std::min(braking, kShareOfBound * Reach(problem.domain.state, kA))),
        jerk_(kShareOfBound * Reach(problem.domain.input, 0)),
        steer_rate_(kShareOfBound * Reach(problem.domain.input, 1)),
        steering_(Reach(problem.domain.state, kDelta)),
        wheelbase_(WheelbaseOf(*problem.model, dt_)),
        bends_{0, steering_ / 4, -steering_ / 4, steering_ / 2, -steering_ / 2} {}

  double dt() const override { return dt_; }
  double Speed(std::span<const double> x) const override { return x[kV]; }
  void Hold(std::span<double> x) const override { x[kV] = x[kA] = 0; }

  // Steers along the arc that meets the heading's line a little ahead (pure pursuit).
  void Pursue(std::span<const double> x, const DesiredMotion& desired, std::span<double> u) const override {
    constexpr double kAhead = 0.8, kLeastAhead = 4, kRelax = 0.6;  // s, m, s
    const double error = std::clamp(std::remainder(desired.heading - x[kTheta], 2 * std::numbers::pi), -1.5, 1.5);
    const double ahead = std::max(kAhead * x[kV], kLeastAhead);
    const double delta = std::clamp(std::atan(2 * wheelbase_ * std::sin(error) / ahead), -steering_, steering_);
    const double a = std::clamp((desired.speed - x[kV]) / kRelax, -deceleration_, deceleration_);
    u[0] = std::clamp((a - x[kA]) / dt_, -jerk_, jerk_);
    u[1] = std::clamp((delta - x[kDelta]) / dt_, -steer_rate_, steer_rate_);
  }

  int num_tails() const override { return static_cast<int>(bends_.size()); }

  bool Brake(std::span<const double> x, int tail, int max_steps, Eigen::MatrixXd& controls) const override {
    const double v = x[kV], a = x[kA], delta = x[kDelta];
    const double steering = std::ceil(std::abs(delta) / (steer_rate_ * dt_));
    const double braking = std::floor(v / (std::max(deceleration_, -a) * dt_));
    if (!(std::max(steering, braking) <= max_steps)) return false;
    int steps = static_cast<int>(std::max(steering, braking));
    while (steps <= max_steps && !CanStop(v, a, steps)) ++steps;
    if (steps > max_steps) return false;
    controls.resize(2, steps);
    FillJerk(a, FindPlateau(v, a, steps), controls);
    FillSteerRate(delta, bends_[static_cast<std::size_t>(tail)], controls);
    return true;
  }

 private:
  void HoldSteering(Eigen::MatrixXd& controls) const override { controls.row(1).setZero(); }

  static constexpr std::size_t kTheta = 2, kV = 3, kA = 4, kDelta = 5;

  static double WheelbaseOf(const NominalModel& model, double dt) {
    constexpr double kAngle = 0.1;
    std::array<double, 8> z{};
    std::array<double, 6> next;
    z[kV] = 1;
    z[kDelta] = kAngle;
    model.Evaluate(z, next);
    return dt * std::tan(kAngle) / next[kTheta];
  }

  // The acceleration after the next control: towards `plateau`, but never further from zero than can be undone in the
  // steps that remain.
  double NextAcceleration(double a, double plateau, int remaining) const {
    const double most = jerk_ * dt_ * remaining, change = jerk_ * dt_;
    const double aim = std::clamp(plateau, -most, most);
    return a + std::clamp(aim - a, -change, change);
  }

  // Speed and acceleration after `steps`; the speed grows with the plateau.
  std::array<double, 2> Finish(double v, double a, double plateau, int steps) const {
    for (int t = 0; t < steps; ++t) {
      v += dt_ * a;
      a = NextAcceleration(a, plateau, steps - 1 - t);
    }
    return {v, a};
  }

  bool CanStop(double v, double a, int steps) const {
    const auto slowest = Finish(v, a, -deceleration_, steps), fastest = Finish(v, a, deceleration_, steps);
    return slowest[1] == 0 && fastest[1] == 0 && slowest[0] <= 0 && fastest[0] >= 0;
  }

  // By bisection; @pre CanStop.
  double FindPlateau(double v, double a, int steps) const {
    double lower = -deceleration_, upper = deceleration_;
    for (int i = 0; i < 52; ++i) {
      const double middle = (lower + upper) / 2;
      (Finish(v, a, middle, steps)[0] <= 0 ? lower : upper) = middle;
    }
    return lower;
  }

  void FillJerk(double a, double plateau, Eigen::MatrixXd& controls) const {
    const int steps = static_cast<int>(controls.cols());
    for (int t = 0; t < steps; ++t) {
      const double next = NextAcceleration(a, plateau, steps - 1 - t);
      controls(0, t) = (next - a) / dt_;
      a = next;
    }
  }

  void FillSteerRate(double delta, double bend, Eigen::MatrixXd& controls) const {
    const int steps = static_cast<int>(controls.cols());
    const double change = steer_rate_ * dt_;
    for (int t = 0; t < steps; ++t) {
      const double most = change * (steps - 1 - t), aim = 2 * t < steps ? std::clamp(bend, -most, most) : 0;
      const double next = delta + std::clamp(aim - delta, -change, change);
      controls(1, t) = (next - delta) / dt_;
      delta = next;
    }
  }

  double dt_, deceleration_, jerk_, steer_rate_, steering_, wheelbase_;
  std::array<double, 5> bends_;  // steering angles, rad
};

/** Constant deceleration against the velocity. */
class PlaneMotion final : public CompiledMotion {
 public:
  PlaneMotion(const Problem& problem, double braking)
      : dt_(problem.model->parameters()[0]),
        deceleration_(std::min({braking, kShareOfBound * Reach(problem.domain.input, 0),
                                kShareOfBound * Reach(problem.domain.input, 1)})) {}

  double dt() const override { return dt_; }
  double Speed(std::span<const double> x) const override { return std::hypot(x[2], x[3]); }
  void Hold(std::span<double> x) const override { x[2] = x[3] = 0; }

  void Pursue(std::span<const double> x, const DesiredMotion& desired, std::span<double> u) const override {
    const std::array<double, 2> velocity{desired.speed * std::cos(desired.heading),
                                         desired.speed * std::sin(desired.heading)};
    for (std::size_t axis = 0; axis < 2; ++axis)
      u[axis] = std::clamp((velocity[axis] - x[axis + 2]) / dt_, -deceleration_, deceleration_);
  }

  int num_tails() const override { return 1; }

  bool Brake(std::span<const double> x, int, int max_steps, Eigen::MatrixXd& controls) const override {
    const double steps = std::ceil(Speed(x) / (deceleration_ * dt_));
    if (!(steps <= max_steps)) return false;
    controls.resize(2, static_cast<int>(steps));
    controls.colwise() = -Eigen::Vector2d(x[2], x[3]) / (steps * dt_);
    return true;
  }

 private:
  void HoldSteering(Eigen::MatrixXd&) const override {}

  double dt_, deceleration_;
};

}  // namespace

std::unique_ptr<RobotMotion> MakeMotion(const Config& config, Braking braking) {
  const Problem& problem = *config.problem;
  if (!config.laws.stop.empty()) {
    if (!config.laws.at_rest)
      throw ConfigError(
          config.path +
          ": planner.at_rest: missing: it says where a braking tail ends; by default where task.rest does, "
          "which is missing, too");
    return std::make_unique<LawMotion>(config, braking);
  }
  const double deceleration =
      braking == Braking::kHardest ? std::numeric_limits<double>::infinity() : config.planner.braking;
  if (const NamedModel* const named = FindNamed(*problem.model); named != nullptr) switch (named->layout) {
      case Layout::kCar: return std::make_unique<CarMotion>(problem, deceleration);
      case Layout::kPlane: return std::make_unique<PlaneMotion>(problem, deceleration);
    }
  throw ConfigError(config.path +
                    ": planner.stop: missing: how the robot brakes, an expression for each input, for example {" +
                    problem.model->input_names()[0] + ": ...}");
}

}  // namespace forereach
