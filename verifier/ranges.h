/** Ranges of functions over intervals, and of their derivatives: of each the least interval, up to rounding. */
#pragma once

#include "verifier/real.h"

namespace forereach::verifier {

/** From the least to the largest number of both. */
[[nodiscard]] Real Hull(const Real& a, const Real& b);

/** phi(e) = exp(-1/e) for e > 0 and 0 for e <= 0, phi' and phi''. */
[[nodiscard]] Real Gate(const Real& e);
[[nodiscard]] Real GateSlope(const Real& e);
[[nodiscard]] Real GateBend(const Real& e);

/** t log(1 + exp(x / t)), which increases in x and t. @pre t > 0. */
[[nodiscard]] Real SoftRamp(const Real& x, const Real& t);
/** With u = x / t: the derivative of SoftRamp by x, 1 / (1 + exp(-u)), that of this by u, and the derivative of
SoftRamp by t. */
[[nodiscard]] Real Logistic(const Real& u);
[[nodiscard]] Real LogisticSlope(const Real& u);
[[nodiscard]] Real SoftRampByTemperature(const Real& u);

/** a |a|, which increases; and 1 for a > 0, -1 for a < 0, from -1 to 1 if 0 is in a: half of its second derivative. */
[[nodiscard]] Real SignedSquare(const Real& a);
[[nodiscard]] Real Sign(const Real& a);

/** tan'' = 2 t (1 + t^2) of the tangent t. */
[[nodiscard]] Real TangentBend(const Real& t);

}  // namespace forereach::verifier
