/** Rigorous lower and upper bounds on the supremum of |d r_row / d z_column| over a domain and a box of parameters, by
interval branch and bound.

The bound over a box is the tighter of two enclosures. The natural enclosure evaluates the derivative over the box. The
mean-value form first replaces every argument in which the derivative is monotone by the end at which the derivative is
largest; then it expands around the middle of the other arguments. Its error decreases with the square of the box's
width. The search next cuts the box of largest bound, across the argument that contributes most to the bound. It never
cuts an argument on which the derivative does not depend. */
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "forereach/declare/cover.h"
#include "forereach/declare/residual_slopes.h"
#include "forereach/reach/domain.h"

namespace forereach {

struct SlopeBoundOptions {
  double gap = 1e-7;                  ///< The search ends when upper <= (1 + gap) lower. Positive.
  std::size_t max_boxes = 1'000'000;  ///< The search ends after this many boxes, with the bound found so far. Positive.
};

/** lower <= sup |d r_row / d z_column| <= upper, in real arithmetic. */
struct SlopeBound {
  int row = 0, column = 0;
  double upper = 0;           ///< The largest bound of a leaf in `cover`, or more.
  double lower = 0;           ///< |d r_row / d z_column| is at least this at `point`.
  std::vector<double> point;  ///< w = (z, theta) in the domain; empty if no point of the domain was found.
  std::size_t boxes = 0;      ///< Number of boxes evaluated.
  bool reached = false;       ///< Whether the search reached the gap.
  /** If `upper` is infinite: a box w without a finite bound, cut until it was too narrow or `max_boxes` was reached.
  Otherwise empty. */
  std::vector<Interval> unbounded;
  Cover cover;  ///< Covers the product of the domain's box and the parameters' box.

  /** (upper - lower) / lower, rounded up; infinite if lower is zero and upper is not. */
  [[nodiscard]] double gap() const;
};

/** Called from time to time with the progress in [0, 1], which never decreases. */
using SlopeProgress = std::function<void(double)>;

/** Bounds |d r_row / d z_column| for all z in the domain and all parameters in their ranges.
@param domain valid for the sizes of the residual. @param parameters one range for each parameter, in order.
@throws std::invalid_argument if a size or an index is wrong, an option is not positive, or the derivative depends on
more than Jet::kMaxArguments arguments. Cost: at most options.max_boxes evaluations of the residual's second
derivatives. */
[[nodiscard]] SlopeBound BoundSlope(const ResidualSlopes& slopes, const Domain& domain,
                                    std::span<const Interval> parameters, int row, int column,
                                    const SlopeBoundOptions& options = {}, const SlopeProgress& progress = {});

}  // namespace forereach
