/** The data that the certify step takes from a nominal model, in plain arithmetic: expansion, remainder and image sums.
expand.h, remainder.h and image.h compute them, as straight-line code for a program that is known at compile time.
rounding.h bounds the error of each number, once for the whole domain. */
#pragma once

#include <array>

#include "forereach/dynamics/program.h"

namespace forereach {

/** An interval whose ends are rounded to nearest, so it is not an enclosure by itself. */
struct PlainInterval {
  double lower, upper;
};

/** f0(c), the nonzero entries of D_z f0(c), and the ranges of the nonzero second derivatives over a box. Entries are in
the order of the program's lists. */
struct Expansion {
  std::array<double, kMaxStates> value;
  std::array<double, Program::kMaxFirst> jacobian;
  std::array<PlainInterval, Program::kMaxSecond> hessian;
};

/** The method that bounds the remainder rho_k(d) = 1/2 d^T H_k d over |d| <= r.
- kPaper: |rho_k| <= 1/2 r^T B_k r, Eq. (qt-formula), with B_k the largest absolute values of the Hessian.
- kCentred: rho_k lies in [lower, upper], and the middle of this interval moves the center. The interval is never wider
  than that of kPaper.

kCentred bounds each term. A diagonal term has d_i^2 in [0, r_i^2]. A mixed product is a quarter of the difference of
two squares, so it lies in [-N, P],
    P, N = (sum_j |g_ij / r_i +- g_lj / r_l|)^2 r_i r_l / 4.
Nearly parallel generators make N or P small. If a diagonal term and a mixed term share a variable, the exact range of
1/2 a s^2 + b s t over |s| <= r_i, |t| <= r_l is a second bound, and the tighter one is used. docs/soundness.md,
3.4, derives this. */
enum class Method { kPaper, kCentred };

/** rho_k lies in center_k +- half_width_k. Zero where f0_k is affine. */
struct Remainder {
  std::array<double, kMaxStates> center, half_width;
};

/** Sums over the generators of an image, computed with the image and used by the next step. */
struct ImageSums {
  std::array<double, kMaxStates> row;  ///< sum_j |(J G)_kj|, in plain arithmetic
};

}  // namespace forereach
