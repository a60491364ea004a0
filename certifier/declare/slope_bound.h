/** The supremum of |d r_row / d z_column| over a domain and a box of parameters, between two rigorous bounds: interval
branch and bound.

A box is bounded by the better of two enclosures. The natural one evaluates the derivative over the box. The mean-value
form first moves every argument in which the derivative is monotone over the box to the end where it is largest, then
expands around the middle of the others: its error shrinks with the square of the box. The box of largest bound is cut
next, across the argument that contributes most to it. Arguments that the derivative does not depend on are never cut.
*/
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "certifier/declare/cover.h"
#include "certifier/declare/residual_slopes.h"
#include "certifier/reach/domain.h"

namespace forereach {

struct SlopeBoundOptions {
  double gap = 1e-7;                  ///< Ends when upper <= (1 + gap) lower.
  std::size_t max_boxes = 1'000'000;  ///< Ends here too, with the bound it has by then.
};

/** lower <= sup |d r_row / d z_column| <= upper, in real arithmetic. */
struct SlopeBound {
  int row = 0, column = 0;
  double upper = 0;           ///< Each leaf's bound in `cover` is at most this.
  double lower = 0;           ///< Attained or exceeded at `point`.
  std::vector<double> point;  ///< w = (z, theta), in the domain; empty if no point of it was found.
  std::size_t boxes = 0;      ///< Evaluated.
  bool reached = false;       ///< Whether the gap was.
  /** Where `upper` is infinite: a box w without a finite bound, cut until it could not be cut further or `max_boxes`
  came. Empty where `upper` is finite. */
  std::vector<Interval> unbounded;
  Cover cover;  ///< Of the domain's box and the parameters' together.

  /** (upper - lower) / lower, rounded up; infinite where lower is zero and upper is not. */
  [[nodiscard]] double gap() const;
};

/** Called now and then with how far the gap is closed, in [0, 1], never falling. */
using SlopeProgress = std::function<void(double)>;

/** @param domain of the residual's sizes, valid. @param parameters the range of each.
@throws std::invalid_argument if a size or an index does not fit, an option is not positive, or the derivative depends
on more than Jet::kMaxArguments arguments. */
[[nodiscard]] SlopeBound BoundSlope(const ResidualSlopes& slopes, const Domain& domain,
                                    std::span<const Interval> parameters, int row, int column,
                                    const SlopeBoundOptions& options = {}, const SlopeProgress& progress = {});

}  // namespace forereach
