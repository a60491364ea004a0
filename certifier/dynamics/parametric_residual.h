/** A residual of which parameters are known to lie in intervals: what a modeller writes into a task file. */
#pragma once

#include <string>
#include <vector>

#include "certifier/numerics/compilation.h"

namespace forereach {

/** {r(.; theta) : lower <= theta <= upper}, r one of residuals.h by name. */
struct ParametricResidual {
  struct Parameter {
    std::string name;
    double lower, upper;
  };

  std::string name;
  std::vector<Parameter> parameters;  ///< All of them, in the order of the equations.
};

}  // namespace forereach
