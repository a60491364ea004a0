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
  bool capped;  ///< True if a limit on the work was met: sound, and perhaps wider than the observations allow.
};

/** Z_t = X_t x {u_t}, with what the step knows of it already. */
struct QuerySet {
  const Zonotope& slice;               ///< X_t
  std::span<const double> input;       ///< u_t
  std::span<const double> half_width;  ///< n upper bounds on the half-widths of the hull of X_t, slack included
};

class ResidualEnclosure {
 public:
  virtual ~ResidualEnclosure() = default;

  /** @pre the hull of the query lies in the certification domain. A coordinate whose lower bound exceeds its upper
  bound proves that no admissible residual exists. */
  virtual void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept = 0;
};

}  // namespace forereach
