/** What the certify step takes of a nominal model, in plain arithmetic: expansion, remainder, and what is known of an
image. expand.h, remainder.h and image.h make them, as straight-line code for a program that is known at compile time;
rounding.h bounds, once and for the whole domain, how far each number can lie from the exact one. */
#pragma once

#include <array>

#include "certifier/dynamics/program.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

/** An interval whose ends were rounded to nearest. */
struct PlainInterval {
  double lower, upper;
};

/** f0(c), D_z f0(c), and the ranges of the second derivatives over a box, in the order of the model's pattern. */
struct Expansion {
  std::array<double, kMaxStates> value;
  std::array<double, Program::kMaxFirst> jacobian;
  std::array<PlainInterval, Program::kMaxSecond> hessian;
};

/** How the remainder is bounded.
kPaper: |rho_k| <= 1/2 r^T B_k r, Eq. (qt-formula), with B_k the largest absolute values of the Hessian.
kCentred: rho_k in [lower, upper], whose middle moves the center. A diagonal term has d_i^2 in [0, r_i^2]. A mixed
  product lies in [-N, P],  P, N = (sum_j |g_ij / r_i +- g_lj / r_l|)^2 r_i r_l / 4,  since d_i d_l is a quarter of
  the difference of two squares; correlated generators make one of them small. Where a diagonal term and a mixed one
  share a variable, a second bound is the exact range of 1/2 a s^2 + b s t over |s| <= r_i, |t| <= r_l, which their sum
  overestimates; the better of the two counts. Never wider than kPaper, and as sound. */
enum class Method { kPaper, kCentred };

/** rho_k lies in center_k +- half_width_k. Zero where f0_k is affine. */
struct Remainder {
  std::array<double, kMaxStates> center, half_width;
};

/** What is known of an image beside its generators. */
struct ImageSums {
  std::array<double, kMaxStates> row;  ///< sum_j |(J G)_kj|, plain
  ColumnScores scores;
};

}  // namespace forereach
