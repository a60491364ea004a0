/** Evaluates a program in 256 bits. */
#pragma once

#include <span>
#include <vector>

#include "forereach/dynamics/evaluate.h"
#include "tests/oracle/exact.h"

// What Evaluate needs of a scalar type besides the functions of exact.h.
namespace forereach::exact {

inline Real sqr(const Real& x) { return x * x; }
inline Real step(const Real& x) { return x > Real(0) ? 1 : 0; }
inline Real sign(const Real& x) { return x > Real(0) ? 1 : x < Real(0) ? -1 : 0; }
inline Real kink(const Real& /*x*/) { return 0; }
inline Real cut(const Real& /*y*/, const Real& /*x*/) { return 0; }
inline Real TanCurvature(const Real& t) { return Real(2) * t * (Real(1) + t * t); }

}  // namespace forereach::exact

namespace forereach {

/** Of each node. */
inline std::vector<exact::Real> InReals(const Program& program, std::span<const double> parameters,
                                        std::span<const exact::Real> z) {
  const std::vector<unsigned char> all(static_cast<std::size_t>(program.size), 1);
  std::vector<exact::Real> values(all.size());
  Evaluate<exact::Real, double>(program, all, parameters, z, values);
  return values;
}

}  // namespace forereach
