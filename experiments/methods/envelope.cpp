#include "experiments/methods/envelope.h"

#include "certifier/residual/observation_store.h"
#include "certifier/residual/observations.h"
#include "experiments/methods/samples.h"

namespace forereach::experiments {

std::unique_ptr<ResidualEnclosure> MakeForeReach(const Setting& setting, const Declaration& declaration) {
  const auto [lower, upper] = setting.domain.Corners();
  declaration.Validate(setting.model.num_states(), setting.model.num_variables());
  return std::make_unique<LipschitzEnvelope>(declaration, Observe(setting.model, setting.data), lower, upper,
                                             EnvelopeOptions{.value_headroom = ObservationStore::kValueHeadroom});
}

std::unique_ptr<ResidualEnclosure> MakeForeReach(const Setting& setting) {
  return MakeForeReach(setting, setting.declaration);
}

std::unique_ptr<ResidualEnclosure> MakeScalarEnvelope(const Setting& setting) {
  Declaration scalar = setting.declaration;
  scalar.lipschitz.setConstant(setting.declaration.lipschitz.maxCoeff());
  return MakeForeReach(setting, scalar);
}

}  // namespace forereach::experiments
