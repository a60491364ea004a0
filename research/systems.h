/** The paper's two systems: the certifier's inputs for each, and the true system, which the certifier does not know.

Model, residual, step, horizon and the deployed declaration are the paper's. Domain extents, data regions and the sizes
of X0 are not in its text. They are ours, and fitted with the scenarios: scenarios.h. */
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "forereach/dynamics/model.h"
#include "forereach/reach/domain.h"
#include "forereach/sets/box.h"

namespace forereach::research {

struct System {
  std::string name;  ///< "point_mass" or "bicycle"
  std::shared_ptr<const NominalModel> model;
  Domain domain;                       ///< Z_cert
  Eigen::MatrixXd deployed;            ///< L, the matrix that the paper deploys: 1.5 times its base
  Box data_region;                     ///< Over z: where observations are drawn, uniformly
  Box quiet_region;                    ///< Over z: below the knee, where the residual is zero or all but zero
  Eigen::VectorXd initial_half_width;  ///< Of X0
  int horizon;                         ///< T
  std::vector<int> sample_sizes;       ///< N, those of the paper
  double noise_scale;                  ///< s of the sub-Gaussian channel; sigma_k = 3 s
  int scenarios;                       ///< In each group and seed
  int rollouts;                        ///< Of the target, for each scenario
  Eigen::VectorXd support_scale;       ///< Of distances to observations (chunks/support.h); none: not measured

  /** f*(z), in extended precision: for observations, which are rounded once. */
  std::function<void(std::span<const long double> z, std::span<long double> next)> target;
  /** r*(z) and f*(z) in plain arithmetic: for rollouts. */
  std::function<void(std::span<const double> z, std::span<double> residual, std::span<double> next)> step;

  [[nodiscard]] int num_states() const { return model->num_states(); }
  [[nodiscard]] int num_inputs() const { return model->num_inputs(); }
  /** P: both systems are judged in their first two coordinates, the position. */
  [[nodiscard]] Eigen::MatrixXd projection() const { return Eigen::MatrixXd::Identity(2, num_states()); }
};

[[nodiscard]] const System& PointMassSystem();
[[nodiscard]] const System& BicycleSystem();
/** Both, in this order. */
[[nodiscard]] std::span<const System* const> Systems();
/** By its name. @throws std::invalid_argument for another. */
[[nodiscard]] const System& SystemNamed(const std::string& name);

/** The median of |r*(z)|_inf over the data region, by the middles of `points` cells on each axis on which r* depends.
 */
[[nodiscard]] double MedianResidual(const System& system, int points = 1000);

}  // namespace forereach::research
