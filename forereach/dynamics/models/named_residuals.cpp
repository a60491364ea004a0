#include "forereach/dynamics/models/named_residuals.h"

#include <algorithm>
#include <stdexcept>

#include "forereach/dynamics/text_program.h"

namespace forereach {

ParametricResidual ResidualOf(const NominalModel& model, const ResidualText& text) {
  ParametricResidual residual{text.name, NamesOf(model), {}};
  auto& [states, inputs, parameters, definitions] = residual.names;
  parameters.insert(parameters.end(), text.parameters.begin(), text.parameters.end());
  definitions.insert(definitions.end(), text.definitions.begin(), text.definitions.end());
  for (const auto& [state, value] : text.values)
    if (std::ranges::find(states, state) == states.end())
      throw std::invalid_argument("the residual " + text.name + " is for a model with the state " + state + ", which " +
                                  model.name() + " does not have");
  for (const std::string& state : states) {
    const auto value = text.values.find(state);
    residual.values.push_back(value == text.values.end() ? ExpressionText{"0"} : value->second);
  }
  return residual;
}

std::span<const ResidualText> NamedResiduals() {
  static const std::vector<ResidualText> residuals{
      {"heading_saturation",
       {{"understeer", 0.32, 0.32}, {"friction", 0.9, 0.9}, {"gravity", 9.81, 9.81}, {"gate_temperature", 0.1, 0.1}},
       {{"lateral", {"abs(v*v*tan(delta)/wheelbase)"}}},
       {{"theta",
         {"-(dt*understeer/wheelbase)*v*tan(delta)*smooth_gate(gate_temperature*(lateral - friction*gravity))"}}}},
      {"velocity_knee",
       {{"damping", 0.4, 0.4},
        {"cross", 0.3, 0.3},
        {"knee", 0.9, 0.9},
        {"softplus_temperature", 0.14, 0.14},
        {"regularizer", 0.15, 0.15},
        {"smoothing", 1e-12, 1e-12}},
       {{"speed", {"sqrt(vx*vx + vy*vy + smoothing)"}},
        {"gain", {"softplus(speed - knee, softplus_temperature)/(speed + regularizer)"}},
        {"drag_x", {"gain*(-(damping*vx) - cross*vy)"}},
        {"drag_y", {"gain*(cross*vx - damping*vy)"}}},
       {{"px", {"dt*dt/2*drag_x"}}, {"py", {"dt*dt/2*drag_y"}}, {"vx", {"dt*drag_x"}}, {"vy", {"dt*drag_y"}}}},
  };
  return residuals;
}

const ResidualText& ResidualNamed(std::string_view name) {
  const auto residuals = NamedResiduals();
  const auto found = std::ranges::find(residuals, name, &ResidualText::name);
  if (found == residuals.end()) throw std::invalid_argument("there is no residual " + std::string(name));
  return *found;
}

}  // namespace forereach
