/** A residual as text whose parameters lie in intervals, as the section `residual` of a task file gives it. */
#pragma once

#include <string>
#include <vector>

#include "forereach/dynamics/model_text.h"
#include "forereach/numerics/compilation.h"

namespace forereach {

/** The set {r(.; theta) : lower <= theta <= upper}, where r_k : z = (x, u) -> R is the expression values[k] and theta
are the parameters of `names`: those of the nominal model, then the residual's own. */
struct ParametricResidual {
  std::string name;  ///< For messages.
  ExpressionNames names;
  std::vector<ExpressionText> values;  ///< One for each state, in their order; "0" where the residual is zero.
};

}  // namespace forereach
