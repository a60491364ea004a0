/** Linear images of zonotopes, with every rounding error accounted for. */
#pragma once

#include <span>

#include "certifier/numerics/interval.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

/** An entry of a sparse interval matrix M; entries that are not listed are zero. */
struct MatrixEntry {
  int row, column;
  Interval value;
};

/** A zonotope that contains {M x : x in set}, M given by its nonzero entries, with as many generators as the set.
Rounding goes to the slack; rows of M that copy one coordinate are copied without error.
@param half_widths upper bounds on the half-widths of the set's interval hull. @param rows of M.
Cost O(nonzeros of M times generators). */
void EncloseLinearImage(std::span<const MatrixEntry> matrix, const Zonotope& set, std::span<const double> half_widths,
                        int rows, Zonotope& image) noexcept;

}  // namespace forereach
