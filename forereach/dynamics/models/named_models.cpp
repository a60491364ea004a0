#include "forereach/dynamics/models/named_models.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>

#include "forereach/dynamics/equations_model.h"
#include "forereach/dynamics/models/kinematic_bicycle.h"
#include "forereach/dynamics/models/point_mass.h"
#include "forereach/dynamics/step_rate.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

void RequirePositive(const char* name, double value) {
  if (!(value > 0 && value < kInfinity))
    throw std::invalid_argument(std::string(name) + ": " + ToText(value) + " is not positive and finite");
}

template <class Array>
std::vector<std::string_view> ListOf(const Array& names) {
  return {names.begin(), names.end()};
}

std::vector<ExpressionText> Texts(const std::vector<std::string_view>& expressions) {
  std::vector<ExpressionText> texts;
  for (const std::string_view expression : expressions) texts.push_back({std::string(expression)});
  return texts;
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

const std::vector<NamedModel>& NamedModels() {
  static const std::vector<NamedModel> models{
      {.name = KinematicBicycle::kName,
       .parameters = {{"wheelbase", "m", "Distance between the axles.", 1000}},
       .states = ListOf(KinematicBicycle::kStateNames),
       .standing = {"v", "a"},
       .next = {"x + dt*(v*cos(theta))", "y + dt*(v*sin(theta))", "theta + dt/wheelbase*(v*tan(delta))", "v + dt*a",
                "a + dt*jerk", "delta + dt*steer_rate"},
       .rates = {"v*cos(theta)", "v*sin(theta)", "v*tan(delta)/wheelbase", "a", "jerk", "steer_rate"},
       .make =
           [](std::span<const double> parameters, std::vector<int> angles) {
             return MakeKinematicBicycle(parameters[0], parameters[1], std::move(angles));
           }},
      {.name = PointMass::kName,
       .parameters = {},
       .states = ListOf(PointMass::kStateNames),
       .standing = {"vx", "vy"},
       .next = {"px + dt*vx + dt*dt/2*ax", "py + dt*vy + dt*dt/2*ay", "vx + dt*ax", "vy + dt*ay"},
       .rates = {"vx", "vy", "ax", "ay"},
       .make =
           [](std::span<const double> parameters, std::vector<int> angles) {
             if (!angles.empty()) throw std::invalid_argument("no state of point_mass is an angle");
             return MakePointMass(parameters[0]);
           }},
  };
  return models;
}

const NamedModel* FindNamed(const NominalModel& model) {
  if (model.text() != nullptr) return nullptr;
  const std::vector<NamedModel>& models = NamedModels();
  const auto found = std::ranges::find(models, model.name(), &NamedModel::name);
  return found == models.end() || found->parameters.size() + 1 != model.parameters().size() ? nullptr : &*found;
}

std::vector<ExpressionText> RatesOf(const NominalModel& model) {
  if (const ModelText* const text = model.text())
    return text->integrator == ModelText::Integrator::kNone ? std::vector<ExpressionText>() : text->equations;
  const NamedModel* const named = FindNamed(model);
  return named == nullptr ? std::vector<ExpressionText>() : Texts(named->rates);
}

std::optional<ModelText> TextOf(const NominalModel& model) {
  if (model.text() != nullptr) return *model.text();
  const NamedModel* const named = FindNamed(model);
  if (named == nullptr) return std::nullopt;
  ModelText text;
  text.name = text.file = model.name();
  for (const std::string& name : model.state_names()) text.states.push_back({name, "1"});
  for (const std::string& name : model.input_names()) text.inputs.push_back({name, "1"});
  for (std::size_t p = 0; p < model.parameters().size(); ++p)
    text.parameters.push_back({model.parameter_names()[p], model.parameters()[p], model.parameters()[p]});
  text.equations = Texts(named->next);
  for (const int angle : model.angles()) text.angles.push_back(model.state_names()[ToSize(angle)]);
  return text;
}

std::shared_ptr<const StepRate> RateOf(const NominalModel& model) {
  std::call_once(model.rate_is_made_, [&] {
    if (const std::optional<ModelText> text = TextOf(model)) model.rate_ = std::make_shared<const StepRate>(*text);
  });
  return model.rate_;
}

}  // namespace forereach
