#include "experiments/statistics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace forereach::experiments {

// Q(a + 1, x) = Q(a, x) + x^a e^-x / Gamma(a + 1), from a = 1/2 or 1.
double ChiSquareTail(double x, int degrees) {
  if (degrees == 0) return 1;
  const bool is_odd = degrees % 2 != 0;
  const double half = x / 2;
  double tail = is_odd ? std::erfc(std::sqrt(half)) : std::exp(-half);
  for (double a = is_odd ? 0.5 : 1; 2 * a < degrees; ++a)
    tail += std::exp(a * std::log(half) - half - std::lgamma(a + 1));
  return std::min(tail, 1.0);
}

double SignTest(int below, int above) {
  const int all = below + above;
  double tail = 0;
  for (int i = 0; i <= std::min(below, above); ++i)
    tail += std::exp(std::lgamma(all + 1) - std::lgamma(i + 1) - std::lgamma(all - i + 1) - all * std::numbers::ln2);
  return std::min(2 * tail, 1.0);
}

}  // namespace forereach::experiments
