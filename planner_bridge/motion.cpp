#include "planner_bridge/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "certifier/dynamics/kinematic_bicycle.h"
#include "certifier/dynamics/point_mass.h"

namespace forereach {
namespace {

// Tails keep this distance from the domain's bounds, so that rounding does not move a control across a bound.
constexpr double kShareOfBound = 0.95;

// The largest magnitude that the bounds allow for both signs of a coordinate.
double Reach(const Box& box, int k) { return std::min(-box.lower()(k), box.upper()(k)); }

/** Jerk-limited deceleration to v = a = 0, while the wheels go to a bend, stay there for half of the time and then
return to straight ahead. */
class BicycleMotion final : public RobotMotion {
 public:
  BicycleMotion(const Problem& problem, double braking)
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
  void Pursue(std::span<const double> x, double heading, double speed, std::span<double> u) const override {
    constexpr double kAhead = 0.8, kLeastAhead = 4, kRelax = 0.6;  // s, m, s
    const double error = std::clamp(std::remainder(heading - x[kTheta], 2 * std::numbers::pi), -1.5, 1.5);
    const double ahead = std::max(kAhead * x[kV], kLeastAhead);
    const double delta = std::clamp(std::atan(2 * wheelbase_ * std::sin(error) / ahead), -steering_, steering_);
    const double a = std::clamp((speed - x[kV]) / kRelax, -deceleration_, deceleration_);
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
class PointMassMotion final : public RobotMotion {
 public:
  PointMassMotion(const Problem& problem, double braking)
      : dt_(problem.model->parameters()[0]),
        deceleration_(std::min({braking, kShareOfBound * Reach(problem.domain.input, 0),
                                kShareOfBound * Reach(problem.domain.input, 1)})) {}

  double dt() const override { return dt_; }
  double Speed(std::span<const double> x) const override { return std::hypot(x[2], x[3]); }
  void Hold(std::span<double> x) const override { x[2] = x[3] = 0; }

  void Pursue(std::span<const double> x, double heading, double speed, std::span<double> u) const override {
    const std::array<double, 2> velocity{speed * std::cos(heading), speed * std::sin(heading)};
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

std::unique_ptr<RobotMotion> MakeMotion(const Problem& problem, double braking) {
  const std::string& name = problem.model->name();
  if (name == KinematicBicycle::kName) return std::make_unique<BicycleMotion>(problem, braking);
  if (name == PointMass::kName) return std::make_unique<PointMassMotion>(problem, braking);
  throw std::invalid_argument("model " + name + ": the planner does not know how it brakes");
}

}  // namespace forereach
