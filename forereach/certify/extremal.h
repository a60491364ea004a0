/** An inner bound: states that systems consistent with data and declaration do reach, so every sound tube contains
them.

The McShane extensions of the observations,
    lower_k(z) = max_i [r~_ik - sigma_k - d_k(z, z_i)],   upper_k(z) = min_i [r~_ik + sigma_k + d_k(z, z_i)],
satisfy the declaration and agree with every observation, if no pair contradicts the declaration. So does any choice of
lower or upper for each coordinate: 2^a extremal residuals, a coordinates with columns in L. A constant coordinate takes
the middle of what the observations leave. */
#pragma once

#include <vector>

#include "forereach/sets/eigen.h"

#include "forereach/certify/decision.h"
#include "forereach/dynamics/model.h"
#include "forereach/residual/declaration.h"
#include "forereach/residual/observations.h"

namespace forereach {

class ExtremalResiduals {
 public:
  ExtremalResiduals(const Declaration& declaration, const Observations& observations);

  /** 2^a. @pre a < 31 */
  [[nodiscard]] int count() const { return 1 << varying_.size(); }

  /** Of each coordinate, whether choice c takes the upper extension. A constant coordinate: false. */
  [[nodiscard]] std::vector<bool> UpperOf(int choice) const;

  /** r_k(z) of choice c in 0 .. count() - 1, in extended precision: bit j of c is 1 where the j-th coordinate that is
  not constant takes its upper extension. Choice 0 is the lower of all, count() - 1 the upper. Cost O(N a). */
  void Evaluate(int choice, const Eigen::VectorXd& z, std::vector<long double>& residual) const;

 private:
  Declaration declaration_;
  Observations observations_;
  std::vector<int> varying_;
  Eigen::VectorXd constant_;
};

/** The states at t = 0 .. T under `plan`, n-by-(S count()), of every extremal residual from each of the S starts, a
column each; choice by choice. They are computed in double, each step rounded: true up to that. */
[[nodiscard]] std::vector<Eigen::MatrixXd> ExtremalRollouts(const NominalModel& model,
                                                            const ExtremalResiduals& residuals, const Plan& plan,
                                                            const Eigen::MatrixXd& starts);

/** Half the largest distance of two projected states: rho_P of any set that contains them is no less. Cost O(S^2). */
[[nodiscard]] double HalfSpread(const Eigen::MatrixXd& projection, const Eigen::MatrixXd& states);

/** The center and corners of a box as columns, n-by-(1 + 2^w) with w half-widths that are not zero. */
[[nodiscard]] Eigen::MatrixXd CornersOf(const Eigen::VectorXd& center, const Eigen::VectorXd& half_width);

}  // namespace forereach
