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

/** Sets the generators of `image` to fl(mid(M) G) and raises error[k] so that, for every matrix in M,
    |(M (G b + diag(s) b'))_k - (image G b)_k| <= increase of error[k], |b|_inf <= 1, |b'|_inf <= 1,
with s the set's slack. Rows of M that copy one coordinate are copied without error. Columns of M beyond the set's dimension are ignored.
@param half_widths upper bounds on the half-widths of the set's interval hull. @param rows of M, those of `image`.
The center of `image` is left alone. Cost O(nonzeros of M times generators). */
void MapGenerators(std::span<const MatrixEntry> matrix, const Zonotope& set, std::span<const double> half_widths,
                   int rows, Zonotope& image, std::span<double> error) noexcept;

/** A zonotope that contains {M x : x in set}, M given by its nonzero entries, with as many generators
as the set; rounding goes to the slack. */
void EncloseLinearImage(std::span<const MatrixEntry> matrix, const Zonotope& set, int rows, Zonotope& image) noexcept;

}  // namespace forereach
