/** The true system of a simulation: nominal model plus residual. The certifier does not know the residual. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "forereach/certify/problem.h"
#include "simulator/disturbance.h"
#include "task/config.h"

namespace forereach {

/** x+ = f0(x, u) + r(x, u), Eq. (dynamics). The sum is computed in extended precision and rounded once, so a recorded
successor is known to its last bit. The error is at most half an ulp of x+ plus 2^-60 of the terms of the sum. */
class Target {
 public:
  virtual ~Target() = default;

  /** Sets `next` to x+. @param x n entries. @param u m entries. @param next n entries; it may be x itself. @param
  longer how much longer than dt the step lasts, s: the state moves on by the rate of the model, and the residual grows
  with a power of the duration, from 1 to the highest that docs/soundness.md, 3.15, allows; 0 where the timing's error
  is 0. The powers of the states are drawn by robot.disturbance_seed. */
  virtual void Step(std::span<const double> x, std::span<const double> u, std::span<double> next,
                    double longer = 0) const = 0;
};

/** What moves a simulated robot: sets `next` to the state that is measured one period after x, under u. It may keep
what is not measured, so it is called once for each step, in their order; between two of them the robot may have stood
or been braked, and x tells. A task's residual is the target's, not a plant's. @param x what it set last, give or take a
disturbance, a brake and whole turns of an angle. @param next n entries; it may be x itself. @param longer how much
longer than dt the step lasted, s. */
using Plant =
    std::function<void(std::span<const double> x, std::span<const double> u, std::span<double> next, double longer)>;

/** The target of a task: its nominal model with the residual of its robot, both for the middles of their parameters.
@throws ConfigError if the residual is for other states or inputs than the model's, or is wrong. */
[[nodiscard]] std::unique_ptr<Target> MakeTarget(const Config& config);

/** A range for one coordinate of z, by its name in the model. */
struct SampleRange {
  std::string name;
  double lower, upper;
};

/** `count` transitions of `target`. z is uniform over the intersection of the domain's box with `ranges`; points that
violate the domain's inequalities or balls are drawn again. The result depends on `seed` only, not on the standard
library or compiler.
@param noise_bound empty, or n entries: each successor gets an error uniform in [-bound, bound].
@param disturbance what disturbs each step, or null.
@throws std::invalid_argument for an unknown name, a range that is empty or not inside the domain, a wrong size, or if
fewer than one point in 1000 lies inside the domain. */
[[nodiscard]] Transitions MakeTransitions(const Target& target, const Problem& problem, std::uint64_t seed, int count,
                                          const std::vector<SampleRange>& ranges = {},
                                          const Eigen::VectorXd& noise_bound = {}, Disturbance* disturbance = nullptr);

}  // namespace forereach
