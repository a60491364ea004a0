/** Driving and braking of a nominal model: what planning needs in addition to its equations. The laws of the task say
it (planner.stop and the keys beside it). */
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "task/config.h"

namespace forereach {

/** What the search wants of a robot in a state. */
struct DesiredMotion {
  double heading = 0;  ///< Of travel, rad, in the plane of the first two safety coordinates.
  double speed = 0;    ///< m/s, in this plane.
  double climb = 0;    ///< m/s, along the third safety coordinate.
};

/** Planned: tails and hints of a plan. Hardest: braking as hard as the robot can, after a withdrawal. */
enum class Braking { kPlanned, kHardest };

class RobotMotion final {
 public:
  /** @throws ConfigError if the task has no planner.stop, or does not say what being at rest or standing is. */
  RobotMotion(const Config& config, Braking braking);

  /** Duration of one step, s. */
  [[nodiscard]] double dt() const { return dt_; }
  /** Where the controls of plans lie: domain.input, from each side nearer by declaration.input_error, since what acts
  has to lie in the domain, too. Where nothing is left, the middle. */
  [[nodiscard]] const Box& controls() const { return controls_; }

  /** Speed in state x, m/s: planner.speed, or else along the way of one step. It may be negative in reverse, which
  plans then do not use. */
  [[nodiscard]] double Speed(std::span<const double> x) const;

  [[nodiscard]] bool IsAtRest(std::span<const double> x) const;

  /** Sets u to a control under which the robot goes on as it does, as far as it can. */
  void Coast(std::span<const double> x, std::span<double> u) const;

  /** Whether there is a Pursue. */
  [[nodiscard]] bool has_hints() const { return hints_.has_value(); }

  /** Sets u to a control for one step that steers x towards this motion, within controls(). It is a hint for the
  search. @pre has_hints(). */
  void Pursue(std::span<const double> x, const DesiredMotion& desired, std::span<double> u) const;

  /** Changes u, a control drawn at random from controls(), into one that the search may try in x. With hints it
  stays as it is: the search tries it for what no hint says. @param share drawn from [0, 1]. */
  void Explore(std::span<const double> x, double share, std::span<double> u) const;

  /** Sets x to the state in which the robot's hold mode leaves it: at rest at its position. */
  void Hold(std::span<double> x) const;

  /** Whether there is a BackOff. */
  [[nodiscard]] bool has_back_off() const { return back_off_.has_value(); }

  /** The controls of planner.back_off from x for a number of steps, and then of a braking tail, as Brake. @pre
  has_back_off(). */
  [[nodiscard]] bool BackOff(std::span<const double> x, int steps, int max_tail, Eigen::MatrixXd& controls) const;

  /** The number of ways to brake. Way 0 is the first of the task; try it first. */
  [[nodiscard]] int num_tails() const { return static_cast<int>(stops_.size()); }

  /** Computes controls that bring the nominal model from x to rest. They lie within controls(); the caller checks
  the states.
  @param tail 0 .. num_tails() - 1. @param controls is set, one column for each step.
  @return false, with `controls` unspecified, if this takes more than max_steps. */
  [[nodiscard]] bool Brake(std::span<const double> x, int tail, int max_steps, Eigen::MatrixXd& controls) const;

 private:
  [[nodiscard]] std::size_t inputs() const;
  [[nodiscard]] bool Rests(std::span<const double> x) const;
  [[nodiscard]] double Clipped(std::size_t k, double value) const;
  void Control(const TextFunction& law, std::span<const double> z, std::span<double> u) const;
  void Step(std::span<const double> x, std::span<const double> u, std::span<double> next) const;

  std::shared_ptr<const Problem> problem_;
  Box controls_;
  double dt_;
  std::vector<int> held_;
  std::vector<RestBound> at_rest_;
  std::vector<TextFunction> stops_;
  std::optional<TextFunction> back_off_, hints_, speed_;
};

}  // namespace forereach
