/** How a nominal model moves and stops: what planning needs beyond its equations. A new model adds its own Motion. */
#pragma once

#include <memory>
#include <span>

#include <Eigen/Core>

#include "certifier/certify/problem.h"

namespace forereach {

class Motion {
 public:
  virtual ~Motion() = default;

  /** Time of one step, s. */
  [[nodiscard]] virtual double dt() const = 0;

  /** Speed in state x, m/s; negative in reverse, which plans do not use. */
  [[nodiscard]] virtual double Speed(std::span<const double> x) const = 0;

  /** A control for one step that takes x towards driving at `speed` (m/s) in the direction of travel `heading` (rad, in
  the plane of the first two coordinates), smoothly and within the input domain: a hint for the search. */
  virtual void Pursue(std::span<const double> x, double heading, double speed, std::span<double> u) const = 0;

  /** Turns x into the state in which the robot's hold mode leaves it: at rest where it is. */
  virtual void Hold(std::span<double> x) const = 0;

  /** Shapes of braking tail to choose from; 0 is the plainest and is to be tried first. */
  [[nodiscard]] virtual int num_tails() const = 0;

  /** Controls, one column a step, that bring the nominal model from x to standstill: speed and its rate end at zero up
  to rounding. Within the input domain; the states in between are the caller's to check.
  @param tail 0 .. num_tails() - 1.
  @return false, with `controls` unspecified, if it takes more than max_steps. */
  [[nodiscard]] virtual bool Brake(std::span<const double> x, int tail, int max_steps,
                                   Eigen::MatrixXd& controls) const = 0;
};

/** The motion of the problem's model: kinematic_bicycle or point_mass.
@param braking deceleration of a braking tail, m/s^2, positive; less if the domain does not allow it.
@throws std::invalid_argument for any other model. */
[[nodiscard]] std::unique_ptr<Motion> MakeMotion(const Problem& problem, double braking);

}  // namespace forereach
