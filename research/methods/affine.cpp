#include "research/methods/affine.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "research/methods/samples.h"

namespace forereach::research {
namespace {

constexpr std::size_t kMostCorners = 10;  // 2^10 points of a query

}  // namespace

AffineEnclosure::AffineEnclosure(const Setting& setting) : active_(ActiveCoordinates(setting.declaration)) {
  if (active_.size() > kMostCorners)
    throw std::invalid_argument("affine: " + std::to_string(active_.size()) + " coordinates, must be at most " +
                                std::to_string(kMostCorners));
  const Observations observations = Observe(setting.model, setting.data);
  const auto [lower, upper] = setting.domain.Corners();
  for (int k = 0; k < observations.num_states(); ++k) {
    AffineSet& set = sets_.emplace_back(active_, lower, upper);
    const double sigma = setting.declaration.noise_bound[k];
    for (int i = 0; i < observations.size(); ++i) {
      const Eigen::VectorXd z = observations.z.row(i);
      set.Add(i, {z.data(), static_cast<std::size_t>(z.size())}, SubDown(observations.lower(i, k), sigma),
              AddUp(observations.upper(i, k), sigma));
    }
    set.Derive();
  }
}

bool AffineEnclosure::IsConsistent() const {
  return std::ranges::none_of(sets_, [](const AffineSet& set) { return set.contradiction().has_value(); });
}

void AffineEnclosure::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  const std::size_t a = active_.size();
  std::array<double, kMostCorners + 1> corner{};
  corner[a] = 1;
  bounds.capped = false;
  for (std::size_t k = 0; k < sets_.size(); ++k) {
    bounds.lower[k] = kInfinity;
    bounds.upper[k] = -kInfinity;
    for (unsigned at = 0; at < 1U << a && !sets_[k].contradiction(); ++at) {
      for (std::size_t l = 0; l < a; ++l) {
        const Interval hull = HullOf(query, active_[l]);
        corner[l] = at >> l & 1 ? hull.upper : hull.lower;
      }
      const Interval image = sets_[k].Enclose({corner.data(), a + 1});
      bounds.lower[k] = std::min(bounds.lower[k], image.lower);
      bounds.upper[k] = std::max(bounds.upper[k], image.upper);
    }
  }
}

std::unique_ptr<ResidualEnclosure> MakeAffine(const Setting& setting) {
  return std::make_unique<AffineEnclosure>(setting);
}

}  // namespace forereach::research
