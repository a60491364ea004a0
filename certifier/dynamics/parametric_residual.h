/** A residual whose parameters lie in intervals, as the section `residual` of a task file gives it. */
#pragma once

#include <string>
#include <vector>

#include "certifier/numerics/compilation.h"

namespace forereach {

/** The set {r(.; theta) : lower <= theta <= upper}, where r is a residual of residuals.h. */
struct ParametricResidual {
  struct Parameter {
    std::string name;
    double lower, upper;
  };

  std::string name;
  std::vector<Parameter> parameters;  ///< All parameters, in the order of the equations and in their units.
};

}  // namespace forereach
