/** How far the plain evaluation of a program (expand.h) can lie from exact arithmetic, anywhere in a domain. */
#pragma once

#include <array>
#include <span>

#include "certifier/dynamics/program.h"
#include "certifier/numerics/interval.h"

namespace forereach {

/** For every z in the domain and every box inside it:
    |Expansion.value_k - f0_k(z)| <= value_k,   |Expansion.jacobian_e - D f0(z)_e| <= jacobian_e,
and each end of Expansion.hessian_e lies at most hessian_e inside of the true range. Infinite where there is no bound.
*/
struct ExpansionError {
  std::array<double, kMaxStates> value{};
  std::array<double, Program::kMaxFirst> jacobian{};
  std::array<double, Program::kMaxSecond> hessian{};
  std::array<double, Program::kMaxFirst> jacobian_size{};  ///< |Expansion.jacobian_e| at most
};

/** What a step adds to its slack and its remainder for rounding, other than what depends on the slice. */
struct StepError {
  std::array<double, kMaxStates> value{};  ///< as in ExpansionError
  /** For every slice whose hull has at most these half-widths r, every J' within `jacobian` of J, and |b|_inf <= 1:
      |(J' G b - fl(J G) b)_k| <= image_k,  image_k = sum_l (jacobian_kl + gamma |J_kl|) r_l,
  gamma the relative error of a sum of as many products. Zero where row k of J copies one coordinate. */
  std::array<double, kMaxStates> image{};
  /** Of each second derivative's term in the remainder: hessian_e r_i r_l, what underflow takes, and 2^-44 of both for
  the sum. */
  std::array<double, Program::kMaxSecond> remainder{};
};

/** @param half_width r, one for each variable; zero for an input. Evaluated upward. */
[[nodiscard]] StepError BoundStepError(const Program& program, const ExpansionError& error,
                                       std::span<const double> half_width) noexcept;

/** Carries, through every operation, the range of its exact values over the domain and a bound on the error of the
plain evaluation, at a point and over a box. Cost O(nodes), once for each task. */
[[nodiscard]] ExpansionError BoundExpansionError(const Program& program, std::span<const double> parameters,
                                                 std::span<const Interval> domain);

}  // namespace forereach
