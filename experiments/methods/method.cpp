#include "experiments/methods/method.h"

#include <array>

#include "certifier/residual/lipschitz_envelope.h"
#include "certifier/residual/observations.h"

namespace forereach::experiments {
namespace {

// The envelope over the domain's box.
std::unique_ptr<ResidualEnclosure> MakeForeReach(const Setting& setting) {
  const Box &state = setting.domain.state, &input = setting.domain.input;
  Eigen::VectorXd lower(state.dim() + input.dim()), upper(lower.size());
  lower << state.lower(), input.lower();
  upper << state.upper(), input.upper();
  const auto size = static_cast<std::size_t>(lower.size());
  return std::make_unique<LipschitzEnvelope>(setting.declaration, Observe(setting.model, setting.data),
                                             std::span(lower.data(), size), std::span(upper.data(), size));
}

}  // namespace

std::span<const Method> Methods() {
  static const std::array<Method, 1> methods{{{"ForeReach", MakeForeReach}}};
  return methods;
}

}  // namespace forereach::experiments
