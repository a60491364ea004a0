/** Driving and braking of a nominal model: the functions that planning needs in addition to its equations. To plan for
a new model, implement RobotMotion for it. */
#pragma once

#include <memory>
#include <span>

#include <Eigen/Core>

#include "certifier/certify/problem.h"

namespace forereach {

class RobotMotion {
 public:
  virtual ~RobotMotion() = default;

  /** Duration of one step, s. */
  [[nodiscard]] virtual double dt() const = 0;

  /** Speed in state x, m/s; negative in reverse, which plans do not use. */
  [[nodiscard]] virtual double Speed(std::span<const double> x) const = 0;

  /** Sets u to a control for one step that steers x smoothly towards speed `speed` (m/s) and direction of travel
  `heading` (rad, in the plane of the first two coordinates), within the input domain. It is a hint for the search. */
  virtual void Pursue(std::span<const double> x, double heading, double speed, std::span<double> u) const = 0;

  /** Sets x to the state in which the robot's hold mode leaves it: at rest at its position. */
  virtual void Hold(std::span<double> x) const = 0;

  /** The number of shapes of braking tails. Shape 0 is the simplest; try it first. */
  [[nodiscard]] virtual int num_tails() const = 0;

  /** Computes controls that bring the nominal model from x to rest: speed and acceleration end at zero up to rounding.
  The controls lie within the input domain; the caller checks the states.
  @param tail shape, 0 .. num_tails() - 1. @param controls is set, one column for each step.
  @return false, with `controls` unspecified, if this takes more than max_steps. */
  [[nodiscard]] virtual bool Brake(std::span<const double> x, int tail, int max_steps,
                                   Eigen::MatrixXd& controls) const = 0;

  /** The number of ways to stop. Way 0 holds the steering as it is; the others are the braking tails, which evade. */
  [[nodiscard]] int num_stops() const { return 1 + num_tails(); }

  /** The same as Brake, in one of the ways to stop, 0 .. num_stops() - 1. */
  [[nodiscard]] bool Stop(std::span<const double> x, int way, int max_steps, Eigen::MatrixXd& controls) const {
    if (!Brake(x, way == 0 ? 0 : way - 1, max_steps, controls)) return false;
    if (way == 0) HoldSteering(controls);
    return true;
  }

 private:
  /** Changes the controls of a braking tail so that the wheels keep their angle; nothing without wheels. */
  virtual void HoldSteering(Eigen::MatrixXd& controls) const = 0;
};

/** The motion of the problem's model: kinematic_bicycle or point_mass.
@param braking deceleration of a braking tail, m/s^2, positive; less if the domain does not allow it, so infinity is the
hardest that it allows.
@throws std::invalid_argument for any other model. */
[[nodiscard]] std::unique_ptr<RobotMotion> MakeMotion(const Problem& problem, double braking);

}  // namespace forereach
