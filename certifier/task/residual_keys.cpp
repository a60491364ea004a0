// The rows of residuals: `residual`, which `forereach declare` bounds, and `robot.residual`.
#include <iterator>

#include "certifier/dynamics/residuals.h"
#include "certifier/task/key_rows.h"

namespace forereach::key_rows {
namespace {

struct Parameter {
  const char *name, *unit;
  Range range;
  const char* meaning;
};

// A residual of dynamics/residuals.h. Its first parameters are its model's.
struct Residual {
  const char* model;
  std::vector<const char*> parameter_names;
  std::vector<double> defaults;     // as many
  std::vector<Parameter> own_rows;  // of those that are not the model's
};

template <class Equations>
Named<Residual> Make(std::vector<Parameter> own_rows) {
  const auto defaults = Equations{}.parameters();
  return {Equations::kName,
          {Equations::Nominal::kName,
           {Equations::kParameterNames.begin(), Equations::kParameterNames.end()},
           {defaults.begin(), defaults.end()},
           std::move(own_rows)}};
}

const std::vector<Named<Residual>>& Residuals() {
  static const std::vector<Named<Residual>> residuals{
      Make<HeadingSaturation>({
          {"understeer", "", kReal, "Fraction of the heading rate lost in full saturation."},
          {"friction", "", kNotNegative, "Friction coefficient; saturation begins at friction times gravity."},
          {"gravity", "m/s^2", kPositive, "Gravity."},
          {"gate_temperature", "s^2/m", kPositive, "How fast the saturation begins."},
      }),
      Make<VelocityKnee>({
          {"damping", "1/s", kReal, "Drag along the velocity."},
          {"cross", "1/s", kReal, "Force across the velocity."},
          {"knee", "m/s", kNotNegative, "The speed above which drag and lateral force act."},
          {"softplus_temperature", "m/s", kPositive, "How fast drag and lateral force begin."},
          {"regularizer", "m/s", kPositive, "Keeps the gain finite at rest."},
          {"smoothing", "m^2/s^2", kPositive, "Makes the speed differentiable at rest."},
      }),
  };
  return residuals;
}

// "A is for model B, ..."
std::string ModelsOfResiduals() {
  std::string text;
  for (const auto& [name, residual] : Residuals())
    text += (text.empty() ? "" : ", ") + std::string(name) + (text.empty() ? " is for " : " for ") + residual.model;
  return text + ".";
}

// A row for each parameter of each residual that is not its model's, in the map `path`.
std::vector<Key> ParameterKeys(const std::string& path, const Key::Reader& read) {
  std::vector<Key> keys;
  for (const auto& [residual_name, residual] : Residuals())
    for (std::size_t i = 0, first = residual.defaults.size() - residual.own_rows.size(); i < residual.own_rows.size();
         ++i) {
      const auto& [name, unit, range, meaning] = residual.own_rows[i];
      if (std::string_view(name) != residual.parameter_names[first + i])
        throw std::logic_error(std::string(residual_name) + " has no parameter " + name + " at this place");
      keys.push_back(OnlyFor(std::string(residual_name), Optional(Number(path + "." + name, unit, range, meaning, read),
                                                                  ToText(residual.defaults[first + i]))));
    }
  return keys;
}

// The residual that is named at `key`: its model's parameters are the model's, all others have the default.
ParametricResidual DefaultResidual(const Document& file, const std::string& key, const NominalModel& model) {
  const std::string name = file.Text(key);
  const Residual& residual = ValueNamed(Residuals(), name);
  if (residual.model != model.name())
    file.Fail(key, name + " is for " + residual.model + ", the model is " + model.name());
  ParametricResidual result{name, {}};
  for (std::size_t i = 0; i < residual.defaults.size(); ++i) {
    const double value = i < model.parameters().size() ? model.parameters()[i] : residual.defaults[i];
    result.parameters.push_back({residual.parameter_names[i], value, value});
  }
  return result;
}

void ReadResidual(const Document& file, const std::string& key, TaskDraft& draft) {
  draft.config.residual = DefaultResidual(file, key, *draft.problem.model);
}

void ReadParameter(const Document& file, const std::string& key, double lower, double upper, TaskDraft& draft) {
  RequireOrdered(file, lower, upper, Entry(key, 0), Entry(key, 1));
  auto& parameters = draft.config.residual->parameters;
  const auto parameter =
      std::ranges::find(parameters, key.substr(key.rfind('.') + 1), &ParametricResidual::Parameter::name);
  parameter->lower = lower;
  parameter->upper = upper;
}

void ReadExactParameter(const Document& file, const std::string& key, TaskDraft& draft) {
  ReadParameter(file, key, file.Number(key), file.Number(key), draft);
}

void ReadParameterRange(const Document& file, const std::string& key, TaskDraft& draft) {
  const Eigen::VectorXd ends = file.Vector(key);
  ReadParameter(file, key, ends[0], ends[1], draft);
}

void ReadRobotResidual(const Document& file, const std::string& key, TaskDraft& draft) {
  RobotOptions& robot = draft.config.robot;
  robot.residual = file.Text(key);
  if (robot.residual == "none") return;
  for (const auto& [name, value, same] : DefaultResidual(file, key, *draft.problem.model).parameters)
    robot.residual_parameters[name] = value;
}

void ReadRobotParameter(const Document& file, const std::string& key, TaskDraft& draft) {
  file.Read(key, draft.config.robot.residual_parameters[key.substr(key.rfind('.') + 1)]);
}

}  // namespace

// What is assumed of the residual, each parameter a number or an interval.
std::vector<Key> ResidualKeys() {
  std::vector<Key> keys{
      Map("residual",
          "Equations of the residual with intervals for its parameters. `forereach declare` derives the declaration "
          "from them. The certifier does not read this key."),
      Required(Word("residual.name", NamesIn(Residuals()), ModelsOfResiduals(), ReadResidual)),
  };
  for (const Key& number : ParameterKeys("residual", ReadExactParameter)) {
    keys.push_back(number);
    Key range = Vector(number.path, number.unit, number.range, Key::Size::kAny, "Its smallest and largest value.",
                       ReadParameterRange);
    range.count = Between(2, 2);
    range.only = number.only;
    keys.push_back(std::move(range));
  }
  return keys;
}

std::vector<Key> RobotResidualKeys() {
  std::vector<std::string_view> names = NamesIn(Residuals());
  names.insert(names.begin(), "none");
  std::vector<Key> keys{
      Optional(Map("robot.residual", "The difference between the real robot and the nominal model."), "none"),
      Required(Word("robot.residual.name", names, ModelsOfResiduals(), ReadRobotResidual)),
  };
  std::ranges::move(ParameterKeys("robot.residual", ReadRobotParameter), std::back_inserter(keys));
  return keys;
}

}  // namespace forereach::key_rows
