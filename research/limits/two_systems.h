/** The two systems that no certifier can tell apart: f0 + r0 +- a phi e_k, where the bump phi is zero at every
observation, Eqs. (bump-properties), (adversarial-residuals).

phi(z) = psi(|z - z_tau| / epsilon) with psi(s) = exp(1 - 1 / (1 - s^2)) for s < 1, else 0: smooth, 1 at the center,
zero outside the ball. */
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "forereach/certify/decision.h"
#include "forereach/dynamics/model.h"
#include "research/limits/smooth_residual.h"

namespace forereach::research {

struct Bump {
  /** sup |psi|, sup |psi'| and sup max(|psi''|, |psi'| / s), rounded up: b_j = kDerivatives[j] / epsilon^j. */
  static constexpr double kDerivatives[] = {1, 2.17036, 21.0659};

  Eigen::VectorXd center;  ///< z_tau
  double radius;           ///< epsilon

  [[nodiscard]] long double operator()(std::span<const long double> z) const;
};

/** A plan of one system, from one state. */
struct Rollout {
  const NominalModel& model;
  const SmoothResidual& residual;  ///< r0
  Plan plan;
  Eigen::VectorXd start;  ///< x_0

  /** x_0 .. x_T of f0 + r0 + amplitude phi e_k as columns, n-by-(T + 1). f0 and the sum are each rounded to double. */
  [[nodiscard]] Eigen::MatrixXd States(const Bump* bump = nullptr, int k = 0, double amplitude = 0) const;
  /** z_0 .. z_{T-1} of f0 + r0 as columns, d_z-by-T. */
  [[nodiscard]] Eigen::MatrixXd Queries() const;
};

/** The two rollouts, with +a and -a. */
struct Pair {
  Eigen::MatrixXd plus, minus;

  /** |P delta_t| / 2: what every tube that contains both has at least for a half-width at t. */
  [[nodiscard]] double HalfSeparation(const Eigen::MatrixXd& projection, int t) const {
    return (projection * (plus.col(t) - minus.col(t))).norm() / 2;
  }
};

[[nodiscard]] Pair RollOutPair(const Rollout& rollout, const Bump& bump, int k, double amplitude);

/** Theorem 1: a |P e_k|, the half-width at tau + 1 that amplitude a forces. It has no bound, as a has none. */
[[nodiscard]] inline double UnrestrictedHalfWidth(const Eigen::MatrixXd& projection, int k, double amplitude) {
  return amplitude * projection.col(k).norm();
}

}  // namespace forereach::research
