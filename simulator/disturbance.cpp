#include "simulator/disturbance.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/growing_disturbance.h"

namespace forereach {
namespace {

constexpr std::uint64_t kOtherNumbers = std::uint64_t{1} << 32;  // seeds are below it

}  // namespace

Disturbance::Disturbance(const Eigen::VectorXd& bounds, std::shared_ptr<const GrowingDisturbance> growing,
                         const std::string& kind, std::uint64_t seed)
    : bounds_(bounds),
      growing_(std::move(growing)),
      acts_(kind != "none" && (growing_ || !bounds.isZero(0))),
      adversarial_(kind == "adversarial"),
      random_(seed),
      signs_(ToSize(bounds.size())) {}

Disturbance::Disturbance(const Declaration& declaration, const RobotOptions& options)
    : Disturbance(declaration.disturbance.size() == 0 ? Eigen::VectorXd::Zero(declaration.noise_bound.size())
                                                      : declaration.disturbance,
                  declaration.growing, options.disturbance, static_cast<std::uint64_t>(options.disturbance_seed)) {
  regions_ = declaration.regions;
}

Disturbance Disturbance::OfMeasurements(const Declaration& declaration, const RobotOptions& options) {
  return {declaration.state_error, nullptr, options.sensor_error,
          kOtherNumbers + static_cast<std::uint64_t>(options.disturbance_seed)};
}

Disturbance Disturbance::OfInputs(const Declaration& declaration, const RobotOptions& options) {
  return {declaration.input_error, nullptr, options.input_error,
          2 * kOtherNumbers + static_cast<std::uint64_t>(options.disturbance_seed)};
}

void Disturbance::Add(std::span<double> next, std::span<const double> z) {
  if (!acts_) return;
  std::vector<Interval> grown(next.size(), 0);
  if (growing_) growing_->Enclose(std::vector<Interval>(z.begin(), z.end()), grown);
  if (adversarial_ && --steps_left_ < 0) {
    // A sign that is held pushes the robot off further than one drawn anew each step.
    steps_left_ = static_cast<int>(random_() % kLongestHold);
    for (double& sign : signs_) sign = random_() >> 63 == 0 ? 1 : -1;
  }
  std::vector<double> bounds(bounds_.begin(), bounds_.end());
  for (const Region& region : regions_)
    if (region.disturbance.size() != 0 && region.Contains(z))
      for (std::size_t k = 0; k < bounds.size(); ++k)
        bounds[k] = std::min(bounds[k], region.disturbance[static_cast<Eigen::Index>(k)]);
  for (std::size_t k = 0; k < next.size(); ++k) {
    // Less than the bound by a unit in the last place, so that the rounded sum is within it, too.
    const double share = Share(k), unit = NextUp(std::abs(next[k])) - std::abs(next[k]);
    const double bound = AddDown(bounds[k], grown[k].lower);
    next[k] += share * std::max(0.0, SubDown(bound, unit));
  }
}

// The share of its bound by which state k is disturbed, from -1 to 1.
double Disturbance::Share(std::size_t k) {
  if (adversarial_) return signs_[k];
  return static_cast<double>(random_() >> 11) * 0x1p-52 - 1;
}

}  // namespace forereach
