#include "robot/brake.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace forereach {

Brake::Brake(std::vector<double> declines) : declines_(std::move(declines)) {
  for (const double decline : declines_)
    if (!(decline >= 0))
      throw std::invalid_argument("Brake: a decline is " + std::to_string(decline) + ", it must not be negative");
}

int Brake::StepsToRest(std::span<const double> lower, std::span<const double> upper) const noexcept {
  double most = 0;
  for (std::size_t k = 0; k < declines_.size(); ++k) {
    if (declines_[k] == 0) continue;
    const double below = std::abs(lower[k]), above = std::abs(upper[k]), limit = kMostSteps * declines_[k];
    if (!(below <= limit) || !(above <= limit)) return kNoEnd;
    if (std::isfinite(declines_[k])) most = std::max(most, std::ceil(std::max(below, above) / declines_[k]));
  }
  return static_cast<int>(most);
}

void Brake::Apply(std::span<const double> before, double share, std::span<double> x) const noexcept {
  for (std::size_t k = 0; k < declines_.size(); ++k) {
    const double decline = declines_[k];
    if (decline == 0) continue;
    const double left = std::isfinite(decline) ? std::abs(before[k]) - share * decline : 0;
    // What is left by rounding alone is rest: else one more step would be braked for.
    x[k] = left > 1e-9 * decline ? std::copysign(left, before[k]) : 0;
  }
}

}  // namespace forereach
