/** Tests whether one zonotope lies in another. A sufficient condition proves containment; it is exact if both have the
same generators up to rounding. If it fails, directions may refute containment. */
#pragma once

#include <Eigen/Core>

#include "verifier/answer.h"
#include "verifier/tube.h"

namespace forereach::verifier {

struct Containment {
  /** kYes: proved. kNo: refuted by a direction in which `inner` reaches further. kUnknown: neither. */
  Answer answer = Answer::kYes;
  int coordinate = -1;  ///< Unless kYes: the coordinate that fails, or -1 for a direction that mixes coordinates.
  Real found, bound;    ///< Unless kYes: the condition is found <= bound.
  Real scale;           ///< Unless kYes: the numbers of `inner` that `found` is made of, by absolute value.
};

/** Whether inner = <c', D> lies in <center, generators>.

Sufficient condition: each column is d_j = gamma_j g_i(j) + delta_j with |gamma_j| <= 1, no g_i is used twice, and for
each coordinate k the unused generators along axis k cover the difference: |c'_k - c_k| + sum_j |delta_jk| <= sum of
their |g_k|. The condition is sound for every choice of pairs and gammas; plain doubles choose them. Cost O(m^2 n) in
doubles, O(m n) in Reals. */
[[nodiscard]] Containment IsInside(const Slice& inner, const Eigen::VectorXd& center,
                                   const Eigen::MatrixXd& generators);

}  // namespace forereach::verifier
