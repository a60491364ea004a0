/** Algorithm 1 of the paper as one would first write it: Eigen matrices of dynamic size, a loop over observations,
plain doubles. The yardstick that ForeReach's speed is a ratio of.

It does what the paper does and no more work than needed at that level: columns of L that are zero are left out of the
signs, rows that are zero are not searched observation by observation, |G^T W s|_1 is computed once a query and not once
an observation, residuals are computed once. It has no rounding control, so its answers are no proofs. */
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "forereach/certify/problem.h"

namespace forereach::bench {

/** <center, generators>: n entries, n-by-m. */
struct PlainZonotope {
  Eigen::VectorXd center;
  Eigen::MatrixXd generators;

  /** Half-widths of the interval hull, |G| 1. */
  [[nodiscard]] Eigen::VectorXd HalfWidth() const { return generators.cwiseAbs().rowwise().sum(); }
};

/** A nominal model with derivatives by hand, over z = (x, u). */
struct PlainModel {
  std::function<Eigen::VectorXd(const Eigen::VectorXd& z)> value;
  std::function<Eigen::MatrixXd(const Eigen::VectorXd& z)> jacobian;
  /** Row by row, B_k,ij >= |d^2 f0_k / dz_i dz_j| over the box, n matrices; infinite where there is no bound. */
  std::function<std::vector<Eigen::MatrixXd>(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper)> curvature;
};

[[nodiscard]] PlainModel PlainBicycle(double dt, double wheelbase);
[[nodiscard]] PlainModel PlainPointMass(double dt);

class Straightforward {
 public:
  /** How the maximum over signs is written: as a product of matrices, or as a loop. The first is faster where a row of
  L has many columns, the second where it has few. */
  enum class Spelling { kMatrices, kLoops };
  enum class Outcome { kCertified, kDomain, kSafety };
  struct Answer {
    Outcome outcome;
    std::vector<PlainZonotope> tube;  ///< X_0 as far as it was computed
  };

  /** @param model the problem's nominal model. */
  Straightforward(std::shared_ptr<const Problem> problem, PlainModel model, Spelling spelling = Spelling::kMatrices);

  /** Eq. (falsification) for every pair and coordinate; the first pair that violates it. Cost O(N^2 n d_z). */
  [[nodiscard]] std::optional<std::pair<int, int>> FindViolation() const;

  /** Algorithm 1 from its third line on. @param controls a column a step. @param obstacles circles in the plane. */
  [[nodiscard]] Answer Certify(const Eigen::MatrixXd& controls, const PlainZonotope& initial_set,
                               const std::vector<Obstacle>& obstacles) const;

  /** Eq. (set-envelope) over the query set: lower and upper bound of each residual coordinate. */
  void Envelope(const PlainZonotope& query, Eigen::VectorXd& lower, Eigen::VectorXd& upper) const;

 private:
  // A row of L without its zero columns.
  struct Row {
    std::vector<int> columns;
    Eigen::MatrixXd signs;      // 2^a-by-a: every s^T W
    Eigen::MatrixXd locations;  // a-by-N
  };

  [[nodiscard]] bool InDomain(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) const;
  [[nodiscard]] std::optional<PlainZonotope> Step(const PlainZonotope& slice, const Eigen::VectorXd& input) const;

  std::shared_ptr<const Problem> problem_;
  PlainModel model_;
  Spelling spelling_;
  std::vector<Row> rows_;
  Eigen::MatrixXd residuals_;  // n-by-N
  Eigen::VectorXd errors_;     // sigma, and 1e-12 for rounding
};

}  // namespace forereach::bench
