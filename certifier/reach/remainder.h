/** The nonlinear Taylor remainder of one step: rho_k(d) = 1/2 d^T H_k d with d = z - c_Z, for all z in the query and all H
in the interval Hessian over its hull. */
#pragma once

#include <array>
#include <vector>

#include "certifier/dynamics/model.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

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

class RemainderBound final {
 public:
  RemainderBound(const Program& program, Method method);

  /** @param half_width r, n entries: inputs are points. @param hessian in the order of the program's.
  @param error of each term, StepError::remainder.
  Rounding is included. An entry that is not finite gives a half-width that is not. Cost O(second derivatives * m). */
  void Enclose(const Zonotope& slice, const double* half_width, const PlainInterval* hessian, const double* error,
               Remainder& out) const noexcept;

 private:
  // One second derivative of states. Its term of 1/2 r^T B r is weight B_il r_i r_l.
  struct Entry {
    std::size_t output, first, second, index;
    double weight;
  };
  // The same, or a mixed one together with a diagonal one of its first variable.
  struct Term {
    std::size_t output, first, second, entry;
    bool has_diagonal;
    std::size_t diagonal;  // entry of (first, first)
    std::size_t pair;      // of a mixed one: which of pairs_
  };
  // Two variables whose product occurs, in one output or more.
  struct Pair {
    std::size_t first, second;
    friend bool operator==(const Pair&, const Pair&) = default;
  };

  void EncloseSizes(const double* half_width, const PlainInterval* hessian, const double* error,
                    Remainder& out) const noexcept;
  void EncloseCentred(const Zonotope& slice, const double* half_width, const PlainInterval* hessian, const double* error,
                      Remainder& out) const noexcept;

  std::vector<Entry> entries_;
  std::vector<Term> terms_;
  std::vector<Pair> pairs_;
  std::size_t states_;
  Method method_;
};

}  // namespace forereach
