#include "research/methods/envelope.h"

#include <utility>

#include "forereach/residual/lipschitz_envelope.h"
#include "forereach/residual/observations.h"
#include "research/methods/samples.h"

namespace forereach::research {
namespace {

class Scaled final : public ResidualEnclosure {
 public:
  Scaled(std::unique_ptr<ResidualEnclosure> whole, double part) : whole_(std::move(whole)), part_(part) {}

  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override {
    whole_->Enclose(query, bounds);
    for (std::size_t k = 0; k < query.half_width.size(); ++k) {
      const double middle = bounds.lower[k] / 2 + bounds.upper[k] / 2, half = part_ * (bounds.upper[k] - middle);
      bounds.lower[k] = middle - half;
      bounds.upper[k] = middle + half;
    }
  }

 private:
  std::unique_ptr<ResidualEnclosure> whole_;
  double part_;
};

}  // namespace

std::unique_ptr<ResidualEnclosure> MakeForeReach(const Setting& setting, const Declaration& declaration) {
  const auto [lower, upper] = setting.domain.Corners();
  declaration.Validate(setting.model.num_states(), setting.model.num_variables());
  return std::make_unique<LipschitzEnvelope>(declaration, Observe(setting.model, setting.data), lower, upper);
}

std::unique_ptr<ResidualEnclosure> MakeForeReach(const Setting& setting) {
  return MakeForeReach(setting, setting.declaration);
}

std::unique_ptr<ResidualEnclosure> MakeScaledForeReach(const Setting& setting, double part) {
  return std::make_unique<Scaled>(MakeForeReach(setting), part);
}

std::unique_ptr<ResidualEnclosure> MakeScalarEnvelope(const Setting& setting) {
  Declaration scalar = setting.declaration;
  scalar.lipschitz.setConstant(setting.declaration.lipschitz.maxCoeff());
  return MakeForeReach(setting, scalar);
}

}  // namespace forereach::research
