#include "certifier/dynamics/models.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "certifier/dynamics/equations_model.h"
#include "certifier/dynamics/kinematic_bicycle.h"
#include "certifier/dynamics/point_mass.h"
#include "certifier/numerics/size.h"
#include "certifier/numerics/text.h"

namespace forereach {
namespace {

void RequirePositive(const char* name, double value) {
  if (!(value > 0 && value < kInfinity))
    throw std::invalid_argument(std::string(name) + ": " + ToText(value) + " is not positive and finite");
}

}  // namespace

std::shared_ptr<const NominalModel> MakePointMass(double dt) {
  RequirePositive("dt", dt);
  return std::make_shared<EquationsModel<PointMass>>(PointMass{dt});
}

std::shared_ptr<const NominalModel> MakeKinematicBicycle(double dt, double wheelbase, std::vector<int> angles) {
  RequirePositive("dt", dt);
  RequirePositive("wheelbase", wheelbase);
  return std::make_shared<EquationsModel<KinematicBicycle>>(KinematicBicycle{dt, wheelbase}, std::move(angles));
}

double StepOf(const NominalModel& model) {
  const auto dt = std::ranges::find(model.parameter_names(), "dt") - model.parameter_names().begin();
  return dt < std::ssize(model.parameters()) ? model.parameters()[ToSize(dt)] : 0;
}

std::vector<ExpressionText> RatesOf(const NominalModel& model) {
  if (const ModelText* const text = model.text())
    return text->integrator == ModelText::Integrator::kNone ? std::vector<ExpressionText>() : text->equations;
  if (model.name() == PointMass::kName) return {{"vx"}, {"vy"}, {"ax"}, {"ay"}};
  if (model.name() == KinematicBicycle::kName)
    return {{"v*cos(theta)"}, {"v*sin(theta)"}, {"v*tan(delta)/wheelbase"}, {"a"}, {"jerk"}, {"steer_rate"}};
  return {};
}

}  // namespace forereach
