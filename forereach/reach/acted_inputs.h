/** How far the inputs that act may be off those of the plan, and what that adds to a step: with |u - u_t| <= e and x in
the slice,

    |f0_k(x, u) + r_k(x, u) - f0_k(x, u_t) - r_k(x, u_t)| <= sum_l (sup |d f0_k / d u_l| + L_kl) e_l,

with the supremum over the hull of the slice and u_t +- e. The step counts both as it does a disturbance.
docs/soundness.md, 3.18. */
#pragma once

#include <array>
#include <span>

#include "forereach/dynamics/model.h"
#include "forereach/numerics/interval.h"
#include "forereach/numerics/limits.h"
#include "forereach/residual/declaration.h"
#include "forereach/sets/eigen.h"

namespace forereach {

struct ActedInputs {
  Eigen::VectorXd error = {};  ///< e, m entries, finite and not negative. No entries: the inputs are the plan's.
  /** sum_l L_kl e_l, rounded up. */
  std::array<double, kMaxStates> of_residual{};

  ActedInputs() = default;
  /** Those of a declaration, whose L bounds the residual. No entries where its errors are zero. */
  explicit ActedInputs(const Declaration& declaration);

  [[nodiscard]] bool AreExact() const { return error.size() == 0; }

  /** Sets what they add to f0, rounded up; infinite where f0 or its slope by an input with an error has no bound.
  Allocates nothing. @param box the hull of the states, and u_t +- e. @pre !AreExact(). */
  void Spread(const NominalModel& model, std::span<const Interval> box,
              std::array<double, kMaxStates>& of_model) const noexcept;
};

}  // namespace forereach
