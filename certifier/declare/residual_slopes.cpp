#include "certifier/declare/residual_slopes.h"

#include <stdexcept>

#include "certifier/dynamics/residuals.h"
#include "certifier/numerics/text.h"

namespace forereach {

std::unique_ptr<ResidualSlopes> MakeResidualSlopes(const std::string& name) {
  if (name == HeadingSaturation::kName) return std::make_unique<EquationsSlopes<HeadingSaturation>>();
  if (name == VelocityKnee::kName) return std::make_unique<EquationsSlopes<VelocityKnee>>();
  throw std::invalid_argument("residual: " + name + " is not heading_saturation or velocity_knee");
}

std::vector<Interval> ParameterRanges(const ResidualSlopes& slopes, const ParametricResidual& residual) {
  const std::vector<std::string>& names = slopes.parameter_names();
  if (residual.parameters.size() != names.size())
    throw std::invalid_argument("residual: " + std::to_string(residual.parameters.size()) + " parameters, " +
                                slopes.name() + " has " + std::to_string(names.size()));
  std::vector<Interval> ranges;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto& [name, lower, upper] = residual.parameters[i];
    if (name != names[i])
      throw std::invalid_argument("residual: parameter " + name + " stands where " + names[i] + " has to");
    if (!(-kInfinity < lower && lower <= upper && upper < kInfinity))
      throw std::invalid_argument("residual: " + name + " in [" + ToText(lower) + ", " + ToText(upper) +
                                  "] is empty or not finite");
    ranges.emplace_back(lower, upper);
  }
  return ranges;
}

}  // namespace forereach
