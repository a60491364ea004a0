/** A smooth residual r0 with the quantities of the information limits: its values, its Jacobian, and bounds on it and
its first two derivatives get. */
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "research/equations_slopes.h"

namespace forereach::research {

/** sup over a domain of |r0|_inf, |D_z r0|_{2->2} and |D_z^2 r0|_{2->2}, each an upper bound. */
struct SmoothBounds {
  double value = 0, slope = 0, curvature = 0;
};

struct SmoothResidual {
  /** r0(z): d_z numbers in, n out. */
  std::function<void(std::span<const long double> z, std::span<long double> residual)> evaluate;
  /** D_z r0(z), n-by-d_z. */
  std::function<Eigen::MatrixXd(std::span<const double> z)> jacobian;
  SmoothBounds bounds;
};

/** Upper bounds over a box of d_z intervals, by interval jets over cells: the coordinates that the residual depends on
are cut in two, at most `halvings` times, until the bounds are within 0.5 % of values at points. Operator norms are
bounded by Frobenius norms, sqrt(sum_k |.|_F^2); for the bicycle's residual the two suprema agree in four digits.
Infinite where a kink is met. Cost: for each level the jets of the cells that may still hold a maximum. */
[[nodiscard]] SmoothBounds BoundSmoothness(const ResidualSlopes& slopes, std::span<const double> parameters,
                                           std::span<const Interval> box, int halvings);

/** D_z r(z) by jets at a point. */
[[nodiscard]] Eigen::MatrixXd JacobianAt(const ResidualSlopes& slopes, std::span<const double> parameters,
                                         std::span<const double> z);

/** r0 = 0 for a model of these sizes. */
[[nodiscard]] SmoothResidual ZeroResidual(int num_states, int num_variables);

/** A residual of dynamics/models/residuals.h over the box. */
template <class Residual>
SmoothResidual Describe(const Residual& residual, std::span<const Interval> box, int halvings = 14) {
  const auto exact = residual.parameters();
  const std::vector<double> parameters(exact.begin(), exact.end());
  return {[residual](std::span<const long double> z, std::span<long double> r) { residual(z, r); },
          [parameters](std::span<const double> z) {
            static const EquationsSlopes<Residual> slopes;
            return JacobianAt(slopes, parameters, z);
          },
          BoundSmoothness(EquationsSlopes<Residual>(), parameters, box, halvings)};
}

}  // namespace forereach::research
