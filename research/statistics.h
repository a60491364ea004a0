/** The few laws that the report's tests and intervals need. */
#pragma once

#include <optional>

namespace forereach::research {

/** The probability that a chi-square variable with this many degrees of freedom is at least x; 1 with none. */
[[nodiscard]] double ChiSquareTail(double x, int degrees);
/** Two-sided: the probability that |t| of Student's law is at least x. @pre x >= 0, degrees >= 1 */
[[nodiscard]] double StudentTail(double x, int degrees);
/** Two-sided: the probability of a split at least as uneven, were each side as likely; 1 with nothing to split. */
[[nodiscard]] double SignTest(int below, int above);

/** @name Intervals that hold the true value with a probability of about 95 %. */
///@{
struct Range {
  double low = 0, high = 0;
};
/** Wilson's, of the part of which `count` of `of` draws are; none without draws. As though draws were independent. */
[[nodiscard]] std::optional<Range> WilsonRange(int count, int of);
/** Student's, of a mean of so many seeds with this sample standard deviation; none with fewer than two. */
[[nodiscard]] std::optional<Range> StudentRange(double mean, double deviation, int seeds);
///@}

}  // namespace forereach::research
