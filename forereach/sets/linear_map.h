/** Linear images of zonotopes. Rounding errors are enclosed in the slack. */
#pragma once

#include <span>

#include "forereach/numerics/interval.h"

namespace forereach {

class Zonotope;

/** A nonzero entry of a sparse interval matrix M. Entries that are not listed are zero. */
struct MatrixEntry {
  int row, column;
  Interval value;
};

/** Sets `image` to a zonotope that contains {M x : x in set, M in the interval matrix} and has as many generators as
`set`. The slack of `image` contains the rounding errors. A row of M that copies one coordinate is exact.
@param matrix the nonzero entries of M. @param half_widths n upper bounds on the half-widths of Box(set).
@param rows number of rows of M, at most kMaxStates. Cost O(nonzeros of M * generators). */
void EncloseLinearImage(std::span<const MatrixEntry> matrix, const Zonotope& set, std::span<const double> half_widths,
                        int rows, Zonotope& image) noexcept;

}  // namespace forereach
