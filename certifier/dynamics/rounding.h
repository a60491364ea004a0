/** How far the plain evaluation of a program (expansion.h) can lie from exact arithmetic, anywhere in a domain. */
#pragma once

#include <array>
#include <span>

#include "certifier/dynamics/program.h"
#include "certifier/numerics/interval.h"

namespace forereach {

/** For every z in the domain and every box inside it:
    |Expansion.value_k - f0_k(z)| <= value_k,   |Expansion.jacobian_e - D f0(z)_e| <= jacobian_e,
and each end of Expansion.hessian_e lies at most hessian_e inside of the true range. Infinite where there is no bound. */
struct ExpansionError {
  std::array<double, kMaxStates> value{};
  std::array<double, Program::kMaxFirst> jacobian{};
  std::array<double, Program::kMaxSecond> hessian{};
};

/** Carries, through every operation, the range of its exact values over the domain and a bound on the error of the
plain evaluation, at a point and over a box. Cost O(nodes), once for each task. */
[[nodiscard]] ExpansionError BoundExpansionError(const Program& program, std::span<const double> parameters,
                                                 std::span<const Interval> domain);

}  // namespace forereach
