/** The paper's two residuals over their domains, with parameters widened at will. */
#pragma once

#include <memory>
#include <vector>

#include "certifier/declare/slope_bound.h"
#include "certifier/dynamics/residuals.h"

namespace forereach {

struct Family {
  std::unique_ptr<ResidualSlopes> slopes;
  Domain domain;
  ParametricResidual residual;
  std::vector<Interval> parameters;

  [[nodiscard]] SlopeBound Bound(int row, int column, const SlopeBoundOptions& options = {}) const {
    return BoundSlope(*slopes, domain, parameters, row, column, options);
  }
};

/** @param widen each parameter but the model's own by so large a part of itself, both ways. */
template <class Residual>
Family MakeFamily(const Residual& residual, double widen) {
  Family family;
  family.slopes = MakeResidualSlopes(Residual::kName);
  family.residual.name = Residual::kName;
  const auto values = residual.parameters();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string name = Residual::kParameterNames[i];
    const double part = name == "dt" || name == "wheelbase" ? 0 : widen;
    family.residual.parameters.push_back({name, values[i] * (1 - part), values[i] * (1 + part)});
  }
  family.parameters = ParameterRanges(*family.slopes, family.residual);
  return family;
}

inline Family Bicycle(double widen = 0) {
  Family family = MakeFamily(HeadingSaturation{0.1, 2.5}, widen);
  Eigen::VectorXd upper(6);
  upper << 40, 40, 3, 25, 3, 0.48;
  Eigen::VectorXd lower = -upper;
  lower[3] = 0;
  family.domain.state = Box(lower, upper);
  family.domain.input = Box(Eigen::Vector2d(-20, -2), Eigen::Vector2d(20, 2));
  return family;
}

inline Family PointMassInBall(double widen = 0) {
  Family family = MakeFamily(VelocityKnee{0.15}, widen);
  family.domain.state = Box(Eigen::Vector4d(-20, -20, -5.4, -5.4), Eigen::Vector4d(20, 20, 5.4, 5.4));
  family.domain.input = Box(Eigen::Vector2d(-3, -3), Eigen::Vector2d(3, 3));
  family.domain.balls.push_back({{2, 3}, Eigen::Vector2d::Zero(), 5.4});
  return family;
}

}  // namespace forereach
