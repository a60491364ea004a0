/** What the certifier needs to know of the residual: an interval per coordinate that contains every admissible value
over a query set. */
#pragma once

#include <array>
#include <span>

#include "certifier/numerics/interval.h"
#include "certifier/numerics/limits.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

/** lower <= r_k(z) <= upper for every admissible residual r and every z in the query set. */
struct ResidualBounds {
  std::array<double, kMaxStates> lower, upper;
};

class ResidualEnclosure {
 public:
  virtual ~ResidualEnclosure() = default;

  /** @param slice X_t. @param input u_t. The query set is slice x {input}, which lies in the certification domain.
  A coordinate whose lower bound exceeds its upper bound proves that no admissible residual exists. */
  virtual void Enclose(const Zonotope& slice, std::span<const double> input, ResidualBounds& bounds) const noexcept = 0;
};

}  // namespace forereach
