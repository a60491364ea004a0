#include "forereach/reach/acted_inputs.h"

#include "forereach/numerics/size.h"

namespace forereach {

ActedInputs::ActedInputs(const Declaration& declaration) {
  if (declaration.input_error.isZero(0)) return;
  error = declaration.input_error;
  for (Eigen::Index k = 0; k < declaration.lipschitz.rows(); ++k)
    for (Eigen::Index l = 0; l < error.size(); ++l) {
      double& sum = of_residual[static_cast<std::size_t>(k)];
      sum = AddUp(sum, MulUp(declaration.lipschitz(k, declaration.lipschitz.rows() + l), error[l]));
    }
}

void ActedInputs::Spread(const NominalModel& model, std::span<const Interval> box,
                         std::array<double, kMaxStates>& of_model) const noexcept {
  of_model = {};
  Linearization linear;
  model.LinearizeOver(box, linear);
  const int n = model.num_states();
  for (std::size_t k = 0; k < ToSize(n); ++k)
    if (!linear.value[k].IsFinite()) of_model[k] = kInfinity;
  for (const auto& [k, l, slope] : linear.jacobian()) {
    if (l < n || error[l - n] == 0) continue;
    double& sum = of_model[ToSize(k)];
    sum = AddUp(sum, slope.IsFinite() ? MulUp(slope.Magnitude(), error[l - n]) : kInfinity);
  }
}

}  // namespace forereach
