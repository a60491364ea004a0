/** The few laws that the report's tests and intervals need. */
#pragma once

namespace forereach::experiments {

/** The probability that a chi-square variable with this many degrees of freedom is at least x; 1 with none. */
[[nodiscard]] double ChiSquareTail(double x, int degrees);
/** Two-sided: the probability of a split at least as uneven, were each side as likely; 1 with nothing to split. */
[[nodiscard]] double SignTest(int below, int above);

}  // namespace forereach::experiments
