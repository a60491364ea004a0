/** Residuals over domains: the paper's two, with parameters widened at will, and made-up ones. */
#pragma once

#include <string>
#include <vector>

#include "forereach/declare/slope_bound.h"
#include "forereach/dynamics/models/named_residuals.h"
#include "tests/worlds.h"

namespace forereach {

struct Family {
  Domain domain;
  ParametricResidual residual;
  TextSlopes slopes{residual};
  std::vector<Interval> parameters = ParameterRanges(residual);

  [[nodiscard]] SlopeBound Bound(int row, int column, const SlopeBoundOptions& options = {}) const {
    return BoundSlope(slopes, domain, parameters, row, column, options);
  }
};

/** @param widen each parameter but the model's own by so large a part of itself, both ways. */
inline ParametricResidual Widened(const NominalModel& model, const char* name, double widen) {
  ResidualText text = ResidualNamed(name);
  for (auto& [parameter, lower, upper] : text.parameters) {
    const double value = lower;
    lower = value * (1 - widen);
    upper = value * (1 + widen);
  }
  return ResidualOf(model, text);
}

inline Family Bicycle(double widen = 0) {
  const Problem problem = PaperBicycle();
  Domain domain = problem.domain;
  Eigen::VectorXd lower = domain.state.lower();
  lower[3] = 0;
  domain.state = Box(lower, domain.state.upper());
  return {domain, Widened(*problem.model, "heading_saturation", widen)};
}

inline Family PointMassInBall(double widen = 0) {
  Problem problem = PaperPointMass();
  problem.domain.balls.push_back({{2, 3}, Eigen::Vector2d::Zero(), 5.4});
  return {problem.domain, Widened(*problem.model, "velocity_knee", widen)};
}

/** {|x|, |y| <= half_width, |u| <= 1}. */
inline Domain Square(double half_width) {
  return {.state = Box(Eigen::Vector2d::Constant(-half_width), Eigen::Vector2d::Constant(half_width)),
          .input = Box(Eigen::VectorXd::Constant(1, -1), Eigen::VectorXd::Constant(1, 1))};
}

/** A residual over the states x and y, the input u and a parameter c. */
inline Family Made(const Domain& domain, const std::string& of_x, const std::string& of_y, const Interval& c = {1, 1}) {
  return {domain, {"made up", {{"x", "y"}, {"u"}, {{"c", c.lower, c.upper}}, {}}, {{of_x}, {of_y}}}};
}

}  // namespace forereach
