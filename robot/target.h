/** The robot that the certifier does not know: nominal model plus residual. */
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "certifier/certify/problem.h"
#include "certifier/task/config.h"

namespace forereach {

/** x+ = f0(x, u) + r(x, u). Computed in extended precision from equations and residual together and rounded once, so
that what is recorded of it is known to its last bit: a nominal successor that was rounded before the residual is
added would be known to two. The error is at most half an ulp of x+ plus 2^-60 of the terms of its sum. */
class Target {
 public:
  virtual ~Target() = default;

  /** @param x n entries. @param u m entries. @param next n entries, may be x itself. */
  virtual void Step(std::span<const double> x, std::span<const double> u, std::span<double> next) const = 0;
};

/** The target that robot.residual names: "none", "heading_saturation" (kinematic_bicycle) or "velocity_knee"
(point_mass). robot.residual_parameters: dt, and for the bicycle wheelbase, which have to be the model's own; any other
member of residuals.h by its name, with the paper's value as default.
@throws ConfigError for a residual that is unknown or another model's, an unknown, missing or non-finite parameter, or a
dt or wheelbase that is not the model's. */
[[nodiscard]] std::unique_ptr<Target> MakeTarget(const Config& config);

/** Narrows one coordinate of z, named as the model names it. */
struct SampleRange {
  std::string name;
  double lower, upper;
};

/** `count` transitions of `target`: z uniform over the domain's box narrowed by `ranges`, kept if inside the whole
domain (inequalities and balls too). The points are the same with every standard library and compiler.
@param noise_bound empty, or n entries: to each successor an error uniform in [-bound, bound] is added.
@throws std::invalid_argument for an unknown name, a range that is empty or not inside the domain, a wrong size, or if
fewer than one point in 1000 lies inside the domain. */
[[nodiscard]] Transitions MakeTransitions(const Target& target, const Problem& problem, std::uint64_t seed, int count,
                                          const std::vector<SampleRange>& ranges = {},
                                          const Eigen::VectorXd& noise_bound = {});

}  // namespace forereach
