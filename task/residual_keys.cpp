// The rows of residuals: `residual`, which `forereach declare` bounds, and `robot.residual`.
#include <iterator>
#include <numbers>

#include "forereach/dynamics/angles.h"
#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/models/named_residuals.h"
#include "forereach/dynamics/text_program.h"
#include "task/key_rows.h"

namespace forereach::key_rows {
namespace {

constexpr const char* kNone = "none";

// A parameter of a residual of the library.
struct ParameterRow {
  const char *residual, *name, *unit;
  Range range;
  const char* meaning;
};

constexpr ParameterRow kParameters[] = {
    {"heading_saturation", "understeer", "", kReal, "Fraction of the heading rate lost in full saturation."},
    {"heading_saturation", "friction", "", kNotNegative,
     "Friction coefficient; saturation begins at friction times gravity."},
    {"heading_saturation", "gravity", "m/s^2", kPositive, "Gravity."},
    {"heading_saturation", "gate_temperature", "s^2/m", kPositive, "How fast the saturation begins."},
    {"velocity_knee", "damping", "1/s", kReal, "Drag along the velocity."},
    {"velocity_knee", "cross", "1/s", kReal, "Force across the velocity."},
    {"velocity_knee", "knee", "m/s", kNotNegative, "The speed above which drag and lateral force act."},
    {"velocity_knee", "softplus_temperature", "m/s", kPositive, "How fast drag and lateral force begin."},
    {"velocity_knee", "regularizer", "m/s", kPositive, "Keeps the gain finite at rest."},
    {"velocity_knee", "smoothing", "m^2/s^2", kPositive, "Makes the speed differentiable at rest."},
};

std::vector<std::string_view> Names() {
  std::vector<std::string_view> names;
  for (const ResidualText& residual : NamedResiduals()) names.push_back(residual.name);
  return names;
}

ModelText::Parameter& ParameterNamed(ResidualText& residual, std::string_view name) {
  const auto found = std::ranges::find(residual.parameters, name, &ModelText::Parameter::name);
  if (found == residual.parameters.end())
    throw std::logic_error(residual.name + " has no parameter " + std::string(name));
  return *found;
}

// The map `path` as a residual: of the library, or as text. Its parameters may be intervals.
ResidualText ReadText(const Document& file, const std::string& path) {
  const bool has_name = Has(file, path, "name");
  if (has_name == Has(file, path, "add"))
    file.Fail(path, has_name ? "has both name and add; delete one of them"
                             : "has neither add, what the next states have beyond the model's, nor name");
  if (!has_name) {
    ResidualText text{"the residual", {}, {}, {}};
    for (const std::string& name : file.KeysOf(path + ".parameters"))
      text.parameters.push_back(ReadParameter(file, path + ".parameters." + name, name));
    for (const std::string& name : file.KeysOf(path + ".let"))
      text.definitions.push_back({name, file.Expression(path + ".let." + name)});
    for (const std::string& state : file.KeysOf(path + ".add"))
      text.values.emplace(state, file.Expression(path + ".add." + state));
    return text;
  }
  ResidualText text = ResidualNamed(file.Text(path + ".name"));
  for (const std::string& key : file.KeysOf(path)) {
    if (key == "name") continue;
    if (key == "parameters" || key == "let")
      file.Fail(path + "." + key, "is for a residual as text, this one has a name");
    ParameterNamed(text, key) = ReadParameter(file, path + "." + key, key);
  }
  return text;
}

// The simulated robot turns its angles into [-pi, pi]; where a domain goes beyond, the residual has to be the same
// after a turn. @throws ExpressionError
void RequireNoJump(const NominalModel& model, const Box& states, const ParametricResidual& residual,
                   const Program& program) {
  std::vector<int> turning;
  for (const int angle : model.angles())
    if (!(-std::numbers::pi <= states.lower()[angle] && states.upper()[angle] <= std::numbers::pi))
      turning.push_back(angle);
  for (std::size_t k = 0; k < residual.values.size(); ++k)
    RequireSameAfterTurns(program, static_cast<int>(k), residual.values[k], "the residual of " + model.state_names()[k],
                          turning, model.state_names());
}

// The residual at `path`. Its expressions are parsed here for the first time.
ParametricResidual ReadResidual(const Document& file, const std::string& path, const Problem& problem) {
  const NominalModel& model = *problem.model;
  const bool is_named = Has(file, path, "name");
  const ResidualText text = ReadText(file, path);
  try {
    const ParametricResidual residual = ResidualOf(model, text);
    const ProgramDraft program = MakeProgram(residual.names, residual.values);
    RequireNoJump(model, problem.domain.state, residual, program.View());
    return residual;
  } catch (const ExpressionError& error) {
    if (!is_named) FailAt(file.path(), error);
    if (error.word().empty()) file.Fail(path + ".name", error.what());
    file.Fail(path + ".name", text.name + " uses " + error.word() + ", which " + model.name() + " does not have");
  } catch (const std::invalid_argument& error) {
    file.Fail(is_named ? path + ".name" : path, error.what());
  }
}

// Rows for the map `path`, each parameter a number or, if `with_ranges`, an interval.
std::vector<Key> Rows(const std::string& path, std::vector<std::string_view> names, bool with_ranges) {
  const auto meaning_of = [&](const std::string& key, const std::string& meaning) {
    return with_ranges ? meaning : "As `residual." + key + "`.";
  };
  std::vector<Key> keys{Word(path + ".name", std::move(names),
                             meaning_of("name",
                                        "A residual of the library, for each model that has its names: those of the "
                                        "paper's car for heading_saturation, of its point mass for velocity_knee."))};
  const auto add = [&](const Key& number) {
    keys.push_back(number);
    if (!with_ranges) return;
    Key range = Vector(number.path, number.unit, number.range, Key::Size::kAny, "Its smallest and largest value.");
    range.count = Between(2, 2);
    range.only = number.only;
    keys.push_back(std::move(range));
  };
  for (const auto& [residual, name, unit, range, meaning] : kParameters) {
    ResidualText text = ResidualNamed(residual);
    add(OnlyFor(residual, Optional(Number(path + "." + name, unit, range, meaning_of(name, meaning)),
                                   ToText(ParameterNamed(text, name).lower))));
  }
  keys.push_back(
      Map(path + ".parameters", meaning_of("parameters", "Of a residual as text, in the units of its expressions.")));
  add(Number(path + ".parameters.<name>", "", kReal, "The value."));
  keys.push_back(Map(path + ".let", meaning_of("let", "Definitions, which later expressions may use.")));
  keys.push_back(Expression(
      path + ".let.<name>",
      meaning_of("let.<name>",
                 "It may use states, inputs, parameters and definitions of the model, these parameters, and the "
                 "definitions before it ([docs/expressions.md](../docs/expressions.md)).")));
  keys.push_back(Map(path + ".add", meaning_of("add",
                                               "A residual as text: what the states have beyond the model's "
                                               "after a step.")));
  keys.push_back(
      Expression(path + ".add.<state>", meaning_of("add.<state>", "What is added to it; zero if it is left out.")));
  return keys;
}

}  // namespace

// What is assumed of the residual, each parameter a number or an interval.
std::vector<Key> ResidualKeys() {
  std::vector<Key> keys = Rows("residual", Names(), true);
  keys.insert(
      keys.begin(),
      Map("residual",
          "The residual's equations, as text or by name, for `forereach declare`. The certifier does not use them.",
          [](const Document& file, const std::string& path, TaskDraft& draft) {
            draft.config.residual = ReadResidual(file, path, draft.problem);
          }));
  return keys;
}

std::vector<Key> RobotResidualKeys() {
  std::vector<std::string_view> names = Names();
  names.insert(names.begin(), kNone);
  std::vector<Key> keys = Rows("robot.residual", std::move(names), false);
  keys.insert(keys.begin(),
              {Optional(Word("robot.residual", {kNone}, "The robot is the nominal model."), kNone),
               Optional(Map("robot.residual", "What the real robot has beyond the nominal model, as text or by name.",
                            [](const Document& file, const std::string& path, TaskDraft& draft) {
                              if (Has(file, path, "name") && file.Text(path + ".name") == kNone) return;
                              draft.config.robot_residual = ReadResidual(file, path, draft.problem);
                            }),
                        kNone)});
  return keys;
}

}  // namespace forereach::key_rows
