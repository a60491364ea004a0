#include "lcmtypes/angle.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace forereach {
namespace {

// Neighbours; 2 pi is between them.
constexpr double kTurnDown = 0x1.921fb54442d18p+2, kTurnUp = 0x1.921fb54442d19p+2;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What `sum`, a + b rounded to nearest, lacks of it: exact (Knuth's TwoSum).
double Remainder(double a, double b, double sum) {
  const double b_part = sum - a, a_part = sum - b_part;
  return (a - a_part) + (b - b_part);
}

}  // namespace

Angles AnglesOf(std::span<const int> states, int num_states) {
  Angles angles;
  for (const int k : states) {
    if (k < 0 || k >= num_states || k >= static_cast<int>(angles.size()))
      throw std::invalid_argument("angles: " + std::to_string(k) + " is none of the " + std::to_string(num_states) +
                                  " states");
    angles.set(static_cast<std::size_t>(k));
  }
  return angles;
}

// The product and the sum are rounded once, to nearest: the neighbour on the far side is beyond the exact number.
Ends TurnTowards(double value, double lower, double upper) {
  if (lower <= value && value <= upper) return {value, value};
  const double turns = std::round((lower / 2 + upper / 2 - value) / kTurnDown);
  if (turns == 0) return {value, value};
  const double least = turns > 0 ? kTurnDown : kTurnUp, most = turns > 0 ? kTurnUp : kTurnDown;
  return {std::nextafter(std::fma(turns, least, value), -kInfinity),
          std::nextafter(std::fma(turns, most, value), kInfinity)};
}

// Rounding is monotone: sums that differ when rounded differ alike before.
bool SumAtMost(double a, double b, double c, double d) {
  const double left = a + b, right = c + d;
  return left == right ? Remainder(a, b, left) <= Remainder(c, d, right) : left < right;
}

Conformance Conform(double measured, double error, double lower, double upper, bool is_angle) {
  const Ends at = is_angle ? TurnTowards(measured, lower, upper) : Ends{measured, measured};
  if (!(error >= 0)) return Conformance::kLeft;
  if (SumAtMost(lower, error, at.lower, 0) && SumAtMost(at.upper, error, upper, 0)) return Conformance::kInside;
  const bool meets = SumAtMost(lower, 0, at.lower, error) && SumAtMost(at.upper, 0, upper, error);
  return meets ? Conformance::kConsistent : Conformance::kLeft;
}

}  // namespace forereach
