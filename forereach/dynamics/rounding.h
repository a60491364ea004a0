/** Bounds on the rounding error of the plain evaluation of a program (expand.h), over a whole domain. */
#pragma once

#include <array>
#include <span>

#include "forereach/dynamics/program.h"
#include "forereach/numerics/interval.h"

namespace forereach {

/** For every z in the domain and every box inside it:
    |Expansion.value_k - f0_k(z)| <= value_k,   |Expansion.jacobian_e - D f0(z)_e| <= jacobian_e,
and each end of Expansion.hessian_e lies at most hessian_e inside the true range. An entry is infinite if there is no
bound. Only as many entries as the program lists are set: to clear the rest took a third of a small step. */
struct ExpansionError {
  std::array<double, kMaxStates> value{};
  std::array<double, Program::kMaxFirst> jacobian;
  std::array<double, Program::kMaxSecond> hessian;
  std::array<double, Program::kMaxFirst> jacobian_size;  ///< upper bounds on |Expansion.jacobian_e|

  /** No bound on anything. */
  [[nodiscard]] static ExpansionError None(const Program& program);
};

/** The contributions of rounding to a step's slack and remainder that do not depend on the slice, set as far as
those above. */
struct StepError {
  std::array<double, kMaxStates> value{};  ///< as in ExpansionError
  /** For every slice whose hull has at most these half-widths r, every J' within `jacobian` of J, and |b|_inf <= 1:
      |(J' G b - fl(J G) b)_k| <= image_k,  image_k = sum_l (jacobian_kl + gamma |J_kl|) r_l,
  gamma the relative error of a sum of that many products. Zero if row k of J copies one coordinate. */
  std::array<double, kMaxStates> image{};
  /** For the term of each second derivative in the remainder: hessian_e r_i r_l, plus the error by underflow, plus
  2^-44 of both for the sum. */
  std::array<double, Program::kMaxSecond> remainder;
};

/** The errors of a step for slices whose hull has half-widths of at most r, rounded up.
@param half_width r, one entry for each of the d_z variables; zero for an input. */
[[nodiscard]] StepError BoundStepError(const Program& program, const ExpansionError& error,
                                       std::span<const double> half_width) noexcept;

/** The errors of the plain evaluation over the domain. For every operation it propagates the range of the exact values
over the domain and a bound on the error of the plain evaluation, at a point and over a box. @param domain d_z ranges.
Cost O(nodes), once for each task. */
[[nodiscard]] ExpansionError BoundExpansionError(const Program& program, std::span<const double> parameters,
                                                 std::span<const Interval> domain);

}  // namespace forereach
