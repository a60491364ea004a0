/** Theorem 2: the half-width that every tube has at the horizon which is sound for all smooth residuals within bounds,
    rho_P(X_T) >= a |P G e_k| - C a^2,   0 < a <= a_star = min(a_class, a_pass, a_lin),
Eqs. (propagation-gain) to (nonlinear-width-lower-bound), with G = A_{T-1} ... A_{tau+1} and A_s = D_x (f0 + r0)(z_s).
As a_star <= a_lin, the right side is largest at a_star.

Norms of Hessians are bounded by those of matrices of absolute values; l_0s by |D_x f0(x_s)| + h_0s varrho_s. Everything
else is plain arithmetic: figures, not bounds to rely on. The paper does not give class, bump or regions; ours:
- R_max, H_1, H_2 are twice the bounds of r0, so every slack is as large as what r0 uses;
- the bump's radius is 0.9 of the most that the gaps allow, min(data gap, query gap / 2);
- all regions have one radius varrho, of those in kRegions the one whose bound is best: each gives a valid bound. */
#pragma once

#include <vector>

#include <Eigen/Core>

#include "research/limits/two_systems.h"

namespace forereach::research {

/** R_max, H_1, H_2 of the bounded smooth class. */
using SmoothClass = SmoothBounds;

struct WidthQuestion {
  const Rollout& rollout;  ///< of f0 + r0
  SmoothClass limits;
  Eigen::MatrixXd data;        ///< z_i, N-by-d_z
  Eigen::MatrixXd projection;  ///< P, p-by-n
};

/** The construction for one time and coordinate, symbols as in the paper. */
struct WidthBound {
  int tau, k;          ///< both counted from 0
  double data_gap;     ///< min_i |z_tau - z_i|
  double query_gap;    ///< min_s |z_tau - z_s|
  double bump_radius;  ///< epsilon
  double gain;         ///< |P G e_k|
  double region;       ///< varrho
  double remainder;    ///< C
  double a_class, a_pass, a_lin, a_star;
  double half_width;  ///< a_star |P G e_k| - C a_star^2

  /** A pair counts if it has a data-free neighbourhood and a gain. */
  [[nodiscard]] bool IsAdmissible() const { return data_gap > 0 && query_gap > 0 && gain > 0; }
};

/** The class that twice the bounds of r0 make. */
[[nodiscard]] inline SmoothClass TwiceTheBounds(const SmoothBounds& bounds) {
  return {2 * bounds.value, 2 * bounds.slope, 2 * bounds.curvature};
}

/** The bound for one pair, 0 <= tau < T. Where the pair is not admissible only the gaps and the gain are set.
@throws std::invalid_argument if r0 leaves the class no slack, or tau or k is out of range. */
[[nodiscard]] WidthBound BoundWidth(const WidthQuestion& question, int tau, int k);

/** All pairs with tau <= T - 2 that are admissible, by tau, then k. */
[[nodiscard]] std::vector<WidthBound> ScanWidthBounds(const WidthQuestion& question);

}  // namespace forereach::research
