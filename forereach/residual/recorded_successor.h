/** What the record of a successor state is good for: the one place that says by how much it may be off. */
#pragma once

#include <algorithm>
#include <cmath>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/interval.h"
#include "forereach/residual/declaration.h"
#include "forereach/residual/observations.h"

namespace forereach {

/** It is known to one unit in its last place; an angle to that of a turn taken off, if that is larger
(observations.h). */
[[nodiscard]] inline double RecordedUnit(double recorded, bool is_angle) {
  const double unit = NextUp(std::abs(recorded)) - std::abs(recorded);
  return is_angle ? std::max(unit, kAngleUnit) : unit;
}

/** {true x_k+} within recorded +- (e_k + sigma_k + unit). @param is_exact then e_k = 0. */
[[nodiscard]] inline Interval EncloseSuccessor(const Declaration& declaration, Eigen::Index k, double recorded,
                                               bool is_angle, bool is_exact) {
  const double error = is_exact ? 0 : declaration.VariableError(k);
  const double off = AddUp(AddUp(error, declaration.noise_bound[k]), RecordedUnit(recorded, is_angle));
  return {SubDown(recorded, off), AddUp(recorded, off)};
}

}  // namespace forereach
