/** Driving and braking of a nominal model: what planning needs in addition to its equations. A task file says it by
laws (planner.stop and the keys beside it); for a compiled model without them there is an implementation in motion.cpp.
*/
#pragma once

#include <memory>
#include <span>

#include <Eigen/Core>

#include "certifier/task/config.h"

namespace forereach {

/** What the search wants of a robot in a state. */
struct DesiredMotion {
  double heading = 0;  ///< Of travel, rad, in the plane of the first two safety coordinates.
  double speed = 0;    ///< m/s, in this plane.
  double climb = 0;    ///< m/s, along the third safety coordinate.
};

class RobotMotion {
 public:
  virtual ~RobotMotion() = default;

  /** Duration of one step, s. */
  [[nodiscard]] virtual double dt() const = 0;

  /** Speed in state x, m/s. It may be negative in reverse, which plans then do not use. */
  [[nodiscard]] virtual double Speed(std::span<const double> x) const = 0;

  [[nodiscard]] virtual bool IsAtRest(std::span<const double> x) const = 0;

  /** Sets u to a control under which the robot goes on as it does, as far as it can. */
  virtual void Coast(std::span<const double> x, std::span<double> u) const = 0;

  /** Whether there is a Pursue. */
  [[nodiscard]] virtual bool has_hints() const = 0;

  /** Sets u to a control for one step that steers x towards this motion, within the input domain. It is a hint for the
  search. @pre has_hints(). */
  virtual void Pursue(std::span<const double> x, const DesiredMotion& desired, std::span<double> u) const = 0;

  /** Changes u, a control drawn at random from the input domain, into one that the search may try in x.
  @param share drawn from [0, 1]. */
  virtual void Explore(std::span<const double> x, const DesiredMotion& desired, double share,
                       std::span<double> u) const = 0;

  /** Sets x to the state in which the robot's hold mode leaves it: at rest at its position. */
  virtual void Hold(std::span<double> x) const = 0;

  /** The number of braking tails. Tail 0 is the simplest; try it first. */
  [[nodiscard]] virtual int num_tails() const = 0;

  /** Computes controls that bring the nominal model from x to rest. They lie within the input domain; the caller checks
  the states.
  @param tail 0 .. num_tails() - 1. @param controls is set, one column for each step.
  @return false, with `controls` unspecified, if this takes more than max_steps. */
  [[nodiscard]] virtual bool Brake(std::span<const double> x, int tail, int max_steps,
                                   Eigen::MatrixXd& controls) const = 0;

  /** The number of ways to stop after a withdrawal. */
  [[nodiscard]] virtual int num_stops() const = 0;

  /** The same as Brake, in one of the ways to stop, 0 .. num_stops() - 1. */
  [[nodiscard]] virtual bool Stop(std::span<const double> x, int way, int max_steps,
                                  Eigen::MatrixXd& controls) const = 0;
};

/** Planned: tails and hints of a plan. Hardest: braking as hard as the robot can, after a withdrawal. */
enum class Braking { kPlanned, kHardest };

/** The motion of a task: by its laws if it has planner.stop, otherwise that of its compiled model.
@throws ConfigError if there is neither, or if the laws lack planner.at_rest or robot.hold. */
[[nodiscard]] std::unique_ptr<RobotMotion> MakeMotion(const Config& config, Braking braking);

}  // namespace forereach
