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

bool LiesWithin(double value, double lower, double upper, bool is_angle) {
  if (!is_angle) return lower <= value && value <= upper;
  const Ends turned = TurnTowards(value, lower, upper);
  return lower <= turned.lower && turned.upper <= upper;
}

}  // namespace forereach
