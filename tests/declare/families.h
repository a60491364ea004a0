/** Residuals over domains: the paper's two, with parameters widened at will, and made-up ones. */
#pragma once

#include <string>
#include <vector>

#include "certifier/declare/slope_bound.h"
#include "certifier/dynamics/models/named_models.h"
#include "certifier/dynamics/models/named_residuals.h"

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
  Domain domain;
  Eigen::VectorXd upper(6);
  upper << 40, 40, 3, 25, 3, 0.48;
  Eigen::VectorXd lower = -upper;
  lower[3] = 0;
  domain.state = Box(lower, upper);
  domain.input = Box(Eigen::Vector2d(-20, -2), Eigen::Vector2d(20, 2));
  return {domain, Widened(*MakeKinematicBicycle(0.1, 2.5), "heading_saturation", widen)};
}

inline Family PointMassInBall(double widen = 0) {
  Domain domain;
  domain.state = Box(Eigen::Vector4d(-20, -20, -5.4, -5.4), Eigen::Vector4d(20, 20, 5.4, 5.4));
  domain.input = Box(Eigen::Vector2d(-3, -3), Eigen::Vector2d(3, 3));
  domain.balls.push_back({{2, 3}, Eigen::Vector2d::Zero(), 5.4});
  return {domain, Widened(*MakePointMass(0.15), "velocity_knee", widen)};
}

/** {|x|, |y| <= half_width, |u| <= 1}. */
inline Domain Square(double half_width) {
  Domain domain;
  domain.state = Box(Eigen::Vector2d::Constant(-half_width), Eigen::Vector2d::Constant(half_width));
  domain.input = Box(Eigen::VectorXd::Constant(1, -1), Eigen::VectorXd::Constant(1, 1));
  return domain;
}

/** A residual over the states x and y, the input u and a parameter c. */
inline Family Made(const Domain& domain, const std::string& of_x, const std::string& of_y, const Interval& c = {1, 1}) {
  return {domain, {"made up", {{"x", "y"}, {"u"}, {{"c", c.lower, c.upper}}, {}}, {{of_x}, {of_y}}}};
}

}  // namespace forereach
