/** The certificate of conformalised system-level-synthesis MPC (Srinivasan et al. 2026), as the paper evaluates it on
fixed plans, Eq. (cpsls-budget): a conformal ellipsoid for each step, and a budget for the probability that all of them
hold, Pr[all eps_k in E_k] >= 1 - sum_k sigma_k, sigma_k = alpha_k + 2 sum_i w~_i d_TV(S^i, S^k) + 2 eps^ M(R_k),
alpha_k = alpha / T, w~_i = w_i / (1 + sum_j w_j),   d_TV(S^i, S^k) <= eps^ |z_k - z_i|_2. From the paper: these
equations, alpha = 0.10 and T = 12, hence alpha_k = 1/120 and the starvation floor 1/alpha_k - 1 = 119: a query with
less weight than that has no finite radius. What it leaves to its code is ours:
- distances are in half-widths of the domain: d(z, z')_l = (z_l - z'_l) / R_l, over all coordinates or over those alone
  that the residual may depend on;
- weights w_i = exp(-|d|^2 / (2 d_z)), one bandwidth unit for the mean square of the coordinates;
- scores s_i = (r~_i^T C(z_i)^-1 r~_i)^(1/2), so E(z) = {e : e^T C(z)^-1 e <= q^2}, and its hull +- q C_kk(z)^(1/2);
- C is one of four plug-ins, each with 1e-6 of its mean variance added to its diagonal;
- eps^ is the largest or the least ratio over coordinates l of: the total variation between the scores of the
observations below and above the median of z_l, by histograms of equal shares, to the distance of the two halves' means;
- M(R_k) is the longest side of the hull of X_k, in the same units. d_TV is at most 1, and taken so.
With the first of each choice nearly every d_TV is at that cap, so the drift is 2 T mass / (1 + mass) whatever eps^ is.
*/
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "research/methods/method.h"

namespace forereach::research {

/** How the covariance of the residual at a location is estimated, around zero, which is what f0 predicts. */
enum class Covariance {
  kLocal,          ///< sum_i w_i(z) r~_i r~_i^T / sum_i w_i(z)
  kLocalDiagonal,  ///< its diagonal
  kGlobal,         ///< sum_i r~_i r~_i^T / N
  kGlobalDiagonal  ///< its diagonal
};

struct CpSlsOptions {
  Covariance covariance = Covariance::kLocal;
  double miscoverage = 0.10;  ///< alpha, in (0, 1)
  int horizon = 12;           ///< T, at least 1
  bool active_only = false;   ///< Distances over the coordinates that L names
  bool least_rate = false;    ///< eps^ is the least of the ratios that are not zero
};

/** T / alpha - 1: the least weight with which a radius is finite. */
[[nodiscard]] inline double StarvationFloor(double miscoverage, int horizon) { return horizon / miscoverage - 1; }

/** sigma_k of one step, or the sum of several. */
struct CpSlsBudget {
  double alpha = 0, drift = 0, tube = 0;
  double at_cap = 0;     ///< Part of the weights whose d_TV is 1; of a sum, their sum
  double mass = 0;       ///< sum_i w_i at the center; of a sum, the last step's
  bool starved = false;  ///< A step had no finite radius.

  /** What the certificate loses; infinite if starved. It says something only below 1. */
  [[nodiscard]] double total() const {
    return starved ? std::numeric_limits<double>::infinity() : alpha + drift + tube;
  }
  [[nodiscard]] bool IsVacuous() const { return !(total() < 1); }

  CpSlsBudget& operator+=(const CpSlsBudget& step) {
    alpha += step.alpha;
    drift += step.drift;
    tube += step.tube;
    at_cap += step.at_cap;
    mass = step.mass;
    starved |= step.starved;
    return *this;
  }
};

/** Claims: with probability 1 - sum_k sigma_k over the data, each step's residual at its center lies inside; nothing
where that is not positive. Not sound. A plan is certified by it only if the sum of Budget over its steps is not
vacuous. */
class CpSls final : public ResidualEnclosure {
 public:
  /** @throws std::invalid_argument if an option is out of range. Cost O(N^2 (d_z + n^2)). */
  CpSls(const Setting& setting, const CpSlsOptions& options);

  /** The hull of E at the center of the query; infinite where it is starved. */
  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;

  /** sigma_k of the step from X_k. */
  [[nodiscard]] CpSlsBudget Budget(const QuerySet& query) const;

  /** sum_i w_i at z. */
  [[nodiscard]] double Mass(const Eigen::VectorXd& z) const;
  /** q_{1 - alpha_k} at z, d_z entries: the smallest score with sum {w~_i : s_i <= q} >= 1 - alpha_k. */
  [[nodiscard]] double Radius(const Eigen::VectorXd& z) const;
  /** eps^. */
  [[nodiscard]] double drift_rate() const { return drift_rate_; }

 private:
  /** The coordinates that count, in half-widths. */
  [[nodiscard]] Eigen::VectorXd Scaled(const Eigen::VectorXd& z) const { return z(measured_).cwiseQuotient(reach_); }
  /** w_i at a scaled location. */
  [[nodiscard]] Eigen::VectorXd Weights(const Eigen::VectorXd& scaled) const;
  [[nodiscard]] Eigen::MatrixXd CovarianceAt(const Eigen::VectorXd& weights) const;
  [[nodiscard]] double EstimateDriftRate() const;

  CpSlsOptions options_;
  std::vector<int> measured_;
  Eigen::VectorXd reach_, recording_;
  Eigen::MatrixXd locations_;  // scaled, N-by-d_z
  Eigen::MatrixXd residuals_;
  Eigen::VectorXd scores_;
  double drift_rate_ = 0;
};

/** All four plug-ins, the local one first, which is the one among Methods(). */
[[nodiscard]] std::span<const Method> CpSlsMethods();
/** The local plug-in with the other choices of distance and drift rate. */
[[nodiscard]] std::span<const Method> CpSlsVariants();

}  // namespace forereach::research
