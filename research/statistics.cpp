#include "research/statistics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace forereach::research {
namespace {

constexpr double kConfidence = 0.95, kNormalQuantile = 1.959964;

// P(|t| < x) of Student's law: finite sums, Abramowitz and Stegun 26.7.3 and 26.7.4.
double StudentWithin(double x, int degrees) {
  const double angle = std::atan(x / std::sqrt(degrees)), square = std::cos(angle) * std::cos(angle);
  const bool is_odd = degrees % 2 != 0;
  double term = is_odd ? std::cos(angle) : 1, sum = 0;
  for (int i = is_odd ? 3 : 2; i <= degrees; i += 2) {
    sum += term;
    term *= square * (i - 1) / i;
  }
  return is_odd ? 2 / std::numbers::pi * (angle + std::sin(angle) * sum) : std::sin(angle) * sum;
}

double StudentQuantile(int degrees) {
  double low = 0, high = 100;
  while (high - low > 1e-9) {
    const double middle = (low + high) / 2;
    (StudentWithin(middle, degrees) < kConfidence ? low : high) = middle;
  }
  return low;
}

}  // namespace

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

double StudentTail(double x, int degrees) { return std::clamp(1 - StudentWithin(x, degrees), 0.0, 1.0); }

double SignTest(int below, int above) {
  const int all = below + above;
  double tail = 0;
  for (int i = 0; i <= std::min(below, above); ++i)
    tail += std::exp(std::lgamma(all + 1) - std::lgamma(i + 1) - std::lgamma(all - i + 1) - all * std::numbers::ln2);
  return std::min(2 * tail, 1.0);
}

std::optional<Range> WilsonRange(int count, int of) {
  if (of == 0) return std::nullopt;
  const double part = static_cast<double>(count) / of, z2 = kNormalQuantile * kNormalQuantile / of;
  const double middle = (part + z2 / 2) / (1 + z2);
  const double half = std::sqrt(z2 * (part * (1 - part) + z2 / 4)) / (1 + z2);
  return Range{std::max(0.0, middle - half), std::min(1.0, middle + half)};
}

std::optional<Range> StudentRange(double mean, double deviation, int seeds) {
  if (seeds < 2) return std::nullopt;
  const double half = StudentQuantile(seeds - 1) * deviation / std::sqrt(seeds);
  return Range{mean - half, mean + half};
}

}  // namespace forereach::research
