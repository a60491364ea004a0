/** Whether one zonotope lies in another, by a sufficient condition that is exact where both have the same generators up
to rounding, and by directions where it does not. */
#pragma once

#include <Eigen/Core>

#include "verifier/answer.h"
#include "verifier/tube.h"

namespace forereach::verifier {

struct Containment {
  /** kYes: proved. kNo: refuted, by a direction in which `inner` reaches further. kUnknown: neither was shown. */
  Answer answer = Answer::kYes;
  int coordinate = -1;  ///< Unless kYes: in which it was not shown, or -1 for a direction that mixes coordinates.
  Real found, bound;    ///< Unless kYes: what has to be at most what.
};

/** Whether inner lies in <center, generators>.

Sufficient: inner's columns d_j are written as gamma_j g_i(j) + delta_j, |gamma_j| <= 1, no g_i taken twice, and for
each coordinate k the generators along that axis which were not taken make up for the rest: |c'_k - c_k| + sum_j
|delta_jk| <= sum of their |g_k|. Any choice of pairs and gammas is sound; doubles choose. Cost O(m^2 n) in doubles, O(m
n) in Reals. */
[[nodiscard]] Containment IsInside(const Slice& inner, const Eigen::VectorXd& center,
                                   const Eigen::MatrixXd& generators);

}  // namespace forereach::verifier
