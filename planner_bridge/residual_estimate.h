/** An estimate of the residual from the recorded transitions, to predict the robot's state. It has no guarantee. */
#pragma once

#include <memory>
#include <span>

#include "forereach/certify/problem.h"

namespace forereach {

class ResidualEstimate final {
 public:
  explicit ResidualEstimate(std::shared_ptr<const Problem> problem);

  /** Predicts the successor f0(z) + r(z), where r(z)_k is the mean of the nearest observed residuals in the distance
  sum_l L_kl |z_l - z_il|, weighted by the inverse square of that distance. If row k of L is zero, r(z)_k is the mean of
  all; of an affine row, the affine function that fits all best.
  @param z d_z entries. @param next n entries, is set. Cost O(N) for each coordinate. */
  void Predict(std::span<const double> z, std::span<double> next) const;

 private:
  [[nodiscard]] double Estimate(int k, std::span<const double> z) const;

  std::shared_ptr<const Problem> problem_;
  Eigen::MatrixXd residuals_;  // N-by-n
  Eigen::MatrixXd fits_;       // of each affine row a column: its slopes by the columns, and its constant
};

}  // namespace forereach
