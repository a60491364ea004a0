#include "identify/binomial.h"

#include <algorithm>

#include <boost/math/distributions/binomial.hpp>

namespace forereach {

// The library's error is some units in the last place; the margin is far above it.
double ProbabilityUpper(int count, int trials, double confidence) {
  constexpr double kMargin = 1 + 1e-9;
  if (count >= trials) return 1;
  const double bound = boost::math::binomial_distribution<double>::find_upper_bound_on_p(trials, count, 1 - confidence);
  return std::min(1.0, bound * kMargin);
}

}  // namespace forereach
