#include "simulator/disturbance.h"

#include <algorithm>
#include <cmath>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"

namespace forereach {

Disturbance::Disturbance(const Declaration& declaration, const RobotOptions& options)
    : declaration_(declaration),
      acts_(options.disturbance != "none" && declaration.IsDisturbed()),
      adversarial_(options.disturbance == "adversarial"),
      random_(static_cast<std::uint64_t>(options.disturbance_seed)),
      signs_(ToSize(declaration.disturbance.size())) {}

void Disturbance::Add(std::span<double> next) {
  if (!acts_) return;
  if (adversarial_ && --steps_left_ < 0) {
    steps_left_ = static_cast<int>(random_() % kLongestHold);
    for (double& sign : signs_) sign = random_() >> 63 == 0 ? 1 : -1;
  }
  for (std::size_t k = 0; k < next.size(); ++k) {
    const double share = Share(k), unit = NextUp(std::abs(next[k])) - std::abs(next[k]);
    next[k] += share * std::max(0.0, SubDown(declaration_.DisturbanceBound(static_cast<Eigen::Index>(k)), unit));
  }
}

// The share of its bound by which state k is disturbed, from -1 to 1.
double Disturbance::Share(std::size_t k) {
  if (adversarial_) return signs_[k];
  return static_cast<double>(random_() >> 11) * 0x1p-52 - 1;
}

}  // namespace forereach
